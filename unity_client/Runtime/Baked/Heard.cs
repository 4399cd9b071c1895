using System;

namespace HapticVLM.Baked
{
    /// <summary>The voice in which touches are heard. Saved scenes contain these numbers.</summary>
    public enum HeardVoice
    {
        /// <summary>Moved to where ears and small speakers hear.</summary>
        Sound = 0,

        /// <summary>As felt, for a palm speaker on an audio output. Most of it is below 300 Hz.</summary>
        True = 1,
    }

    /// <summary>
    /// The touches of both hands as samples for an output that is not a motor. The sound voice is rendered at
    /// SoundVoice.InHz, moved, and read at the output's rate through a windowed sinc. Knows no engine and no clock.
    /// </summary>
    public sealed class Heard
    {
        private const int Half = 8, Taps = 2 * Half, Phases = 256; // Half: taps on either side
        private static readonly double[] Table = Weights();

        private readonly FeelPlayer player;
        private readonly SoundVoice sound; // null in the true voice
        private readonly double step; // samples of the sound voice for each of the output
        private double[] line = new double[Taps]; // samples of the sound voice that are not yet behind the window
        private double at; // position of the next output sample, from the begin of the first full window of the line

        /// <summary>`rate` is that of the output, Hz.</summary>
        public Heard(Feel feel, int rate, HeardVoice voice)
        {
            sound = voice == HeardVoice.True ? null : new SoundVoice();
            player = new FeelPlayer(feel, sound == null ? rate : SoundVoice.InHz);
            step = (double)SoundVoice.OutHz / rate;
        }

        /// <summary>Whether Render would give zeros until the next touch, so that it need not be called.</summary>
        public bool IsSilent
        {
            get { return player.IsSilent && (sound == null || sound.IsSilent && Array.TrueForAll(line, sample => sample == 0.0)); }
        }

        public void Touch(FeltTouch touch, double now)
        {
            player.Touch(touch, now);
        }

        /// <summary>Fades a hand and keeps it silent, or lets its touches be heard from their next renewal.</summary>
        public void Mute(string hand, bool isMuted)
        {
            player.Mute(hand, isMuted);
        }

        /// <summary>Ends everything within 20 ms, as sound 24 ms later; a hand is heard again after its release and a new touch.</summary>
        public void Stop()
        {
            player.Stop();
        }

        /// <summary>Ends one hand, as Stop does.</summary>
        public void Hold(string hand)
        {
            player.Hold(hand);
        }

        /// <summary>Returns the next samples, -1..1; `now` is the time of the first, s.</summary>
        public double[] Render(int count, double now)
        {
            if (sound == null) return player.Render(count, now);
            double end = at + count * step;
            int passed = (int)end, missing = (passed + Taps - line.Length + SoundVoice.Up - 1) / SoundVoice.Up;
            if (missing > 0) Append(sound.Render(player.Render(missing, now)));
            var wave = new double[count];
            for (int index = 0; index < count; index++) wave[index] = Sample(at + index * step);
            line = Synthesis.Slice(line, passed, line.Length - passed);
            at = end - passed;
            return wave;
        }

        private void Append(double[] next)
        {
            int before = line.Length;
            Array.Resize(ref line, before + next.Length);
            Array.Copy(next, 0, line, before, next.Length);
        }

        private double Sample(double position)
        {
            int whole = (int)position, row = Taps * (int)Math.Round((position - whole) * Phases);
            double sum = 0.0;
            for (int tap = 0; tap < Taps; tap++) sum += Table[row + tap] * line[whole + tap];
            return sum;
        }

        /// <summary>(Phases + 1, Taps) weights; row r is for the position r / Phases between two samples.</summary>
        private static double[] Weights()
        {
            var table = new double[(Phases + 1) * Taps];
            for (int row = 0; row <= Phases; row++)
            {
                for (int tap = 0; tap < Taps; tap++)
                {
                    double x = tap - Half + 1 - (double)row / Phases, window = Math.Cos(Math.PI * x / Taps);
                    table[row * Taps + tap] = window * window * (x == 0.0 ? 1.0 : Math.Sin(Math.PI * x) / (Math.PI * x));
                }
            }
            return table;
        }
    }
}
