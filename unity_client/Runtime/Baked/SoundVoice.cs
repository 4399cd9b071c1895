using System;

namespace HapticVLM.Baked
{
    /// <summary>
    /// Makes a vibration audible: sound_voice.py, which has the figures and the reasons. Takes the true voice at InHz and
    /// returns the sound voice at OutHz, 24 ms later.
    /// </summary>
    internal sealed class SoundVoice
    {
        public const int InHz = 3000, Up = 4, OutHz = Up * InHz;
        private const double HalfS = 0.024, Level = 0.22, Exponent = 0.25, Lowest = 1e-3, FallPerS = 1.0;
        private const int ShiftHz = 300, Half = 72, Span = 2 * Half + 1, Period = OutHz / ShiftHz; // Half is HalfS * InHz
        private static readonly double[] EdgesHz = { 0.0, 90.0, 190.0, 400.0, 1100.0 }, Weights = { 1.6, 1.3, 1.0, 0.8 };
        private static readonly double Fall = Math.Exp(-FallPerS / InHz);
        private static readonly double[] Kernels = AllKernels();
        private static readonly double[] ShiftRe = Turns(Math.Cos), ShiftIm = Turns(Math.Sin);

        private readonly double[] line = new double[2 * Span]; // the newest samples twice, so that a window never wraps
        private int at; // where the oldest one is
        private int turn;
        private int zeros = Span; // in a row
        private double level;

        /// <summary>Whether zeros in give zeros out and change nothing that is heard later.</summary>
        public bool IsSilent
        {
            get { return zeros >= Span && level <= Lowest; }
        }

        /// <summary>Returns the next samples as sound, Up for each, -1..1.</summary>
        public double[] Render(double[] samples)
        {
            var heard = new double[samples.Length * Up];
            for (int index = 0; index < samples.Length; index++)
            {
                line[at] = line[at + Span] = samples[index];
                at = (at + 1) % Span;
                zeros = samples[index] == 0.0 ? Math.Min(zeros + 1, Span) : 0;
                double gain = Gain();
                for (int phase = 0; phase < Up; phase++)
                {
                    if (zeros < Span) heard[index * Up + phase] = Math.Min(Math.Max(gain * Sample(phase), -1.0), 1.0);
                    turn = (turn + 1) % Period;
                }
            }
            return heard;
        }

        private double Gain()
        {
            double sum = 0.0;
            for (int index = 0; zeros < Span && index < Span; index++) sum += line[index] * line[index];
            level = Math.Max(Math.Sqrt(sum / Span), level * Fall);
            return Level * Math.Pow(Math.Max(level, Lowest), Exponent - 1.0);
        }

        private double Sample(int phase)
        {
            double wave = 0.0;
            for (int band = 0; band < Weights.Length; band++)
            {
                double re = 0.0, im = 0.0;
                int weight = 2 * Span * (band * Up + phase);
                for (int index = at; index < at + Span; index++)
                {
                    re += line[index] * Kernels[weight++];
                    im += line[index] * Kernels[weight++];
                }
                double size = Math.Sqrt(re * re + im * im), unit = Math.Max(size, 1e-12);
                re /= unit;
                im /= unit;
                double re2 = re * re - im * im, im2 = 2.0 * re * im;
                wave += size * ((re2 * re2 - im2 * im2) * ShiftRe[turn] - 2.0 * re2 * im2 * ShiftIm[turn]);
            }
            return wave;
        }

        /// <summary>The analytic kernels under their window: (bands, Up, Span, 2) weights of the samples, the oldest first, real and imaginary.</summary>
        private static double[] AllKernels()
        {
            var kernels = new double[Weights.Length * Up * Span * 2];
            int weight = 0;
            for (int band = 0; band < Weights.Length; band++)
            {
                for (int phase = 0; phase < Up; phase++)
                {
                    for (int index = 0; index < Span; index++, weight += 2) Kernel(kernels, weight, band, (double)(Up * (Span - 1 - index - Half) + phase) / OutHz);
                }
            }
            return kernels;
        }

        private static void Kernel(double[] kernels, int weight, int band, double seconds)
        {
            if (Math.Abs(seconds) >= HalfS) return;
            double low = EdgesHz[band], high = EdgesHz[band + 1], around = Math.PI * seconds;
            double scale = Weights[band] * (0.5 + 0.5 * Math.Cos(around / HalfS)) / InHz;
            kernels[weight] = scale * (seconds == 0.0 ? 2.0 * (high - low) : (Math.Sin(2.0 * high * around) - Math.Sin(2.0 * low * around)) / around);
            kernels[weight + 1] = seconds == 0.0 ? 0.0 : scale * (Math.Cos(2.0 * low * around) - Math.Cos(2.0 * high * around)) / around;
        }

        private static double[] Turns(Func<double, double> part)
        {
            var turns = new double[Period];
            for (int index = 0; index < Period; index++) turns[index] = part(2.0 * Math.PI * index / Period);
            return turns;
        }
    }
}
