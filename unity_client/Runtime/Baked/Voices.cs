using System;
using System.Collections.Generic;
using System.Linq;

namespace HapticVLM.Baked
{
    /// <summary>The voices of one hand: voices.py.</summary>
    internal sealed class Voices
    {
        private readonly Feel feel;
        private readonly int rate;
        private List<Voice> voices = new List<Voice>();
        private Command texture, press;
        private FeltHum hum;
        private double expiresAt = double.NegativeInfinity;
        private Limiter limiter;

        public Voices(Feel feel, int rate)
        {
            this.feel = feel;
            this.rate = rate;
            limiter = new Limiter(feel.Rules.Voices, rate);
        }

        public bool IsSilent
        {
            get { return voices.Count == 0 && texture == null && press == null && hum == null && limiter.IsEmpty; }
        }

        public Voices Fork()
        {
            var forked = (Voices)MemberwiseClone();
            forked.voices = voices.ConvertAll(voice => voice.Fork());
            forked.limiter = limiter.Fork();
            return forked;
        }

        public void Silence()
        {
            Rest();
            voices.Clear();
            limiter = new Limiter(feel.Rules.Voices, rate);
        }

        /// <summary>Fades what sounds; an impact that has not begun is dropped.</summary>
        public void Rest()
        {
            texture = press = null;
            hum = null;
            expiresAt = double.NegativeInfinity;
            voices.RemoveAll(IsAboutToBegin);
            foreach (Voice voice in voices) voice.Aim = 0.0;
        }

        public List<Voice> Beginning()
        {
            return voices.FindAll(IsAboutToBegin);
        }

        public void Apply(Command command)
        {
            expiresAt = command.ExpiresAt;
            hum = command.Hum;
            FeltMaterial facts = feel.Find(command.Material);
            if (facts == null)
            {
                texture = press = null;
                return;
            }
            press = command.Interaction == "press" && facts.PressNPerGrain != null ? command : null;
            if (command.Onset && command.Interaction != "swing") Strike(command, facts);
            bool isHeld = command.Onset || FeelPlayer.Impacts.Contains(command.Interaction);
            texture = FeelPlayer.Textures.Contains(command.Interaction) || !isHeld ? command : null;
        }

        public double[] Render(int count, double now)
        {
            var wave = new double[count];
            if (IsSilent) return wave;
            for (int begin = 0; begin < count; begin += feel.Rules.Chunk)
            {
                var part = new double[Math.Min(feel.Rules.Chunk, count - begin)];
                Mix(part, now + (double)begin / rate);
                Array.Copy(part, 0, wave, begin, part.Length);
            }
            return wave;
        }

        private void Mix(double[] part, double now)
        {
            if (!(expiresAt >= now)) Rest();
            FollowTexture();
            FollowPress();
            FollowHum();
            double step = 1.0 / (feel.Rules.FadeS * rate);
            foreach (Voice voice in voices) voice.AddTo(part, step);
            voices.RemoveAll(voice => voice.Ended);
            limiter.Apply(part);
        }

        private static bool IsAboutToBegin(Voice voice)
        {
            var played = voice.Source as Played;
            return played != null && played.At == 0;
        }

        private void Strike(Command command, FeltMaterial facts)
        {
            List<Voice> impacts = voices.FindAll(voice => voice.Source is Played);
            if (impacts.Count >= feel.Rules.MaxImpacts) return;
            List<Voice> loud = impacts.FindAll(voice => voice.Aim > 0.0);
            if (loud.Count >= feel.Rules.MaxRinging) loud[0].Aim = 0.0;
            string kind = FeelPlayer.Impacts.Contains(command.Interaction) ? command.Interaction : "tap";
            voices.Add(new Voice(new Played(Synthesis.Impact(feel, facts, kind, command, rate)), command, kind, command.Gain, command.Gain));
        }

        private void FollowTexture()
        {
            List<Voice> textures = voices.FindAll(voice => voice.Source is Texture);
            foreach (Voice voice in textures) voice.Aim = 0.0;
            if (texture == null) return;
            string kind = FeelPlayer.Textures.Contains(texture.Interaction) ? texture.Interaction : "slide";
            Voice current = textures.LastOrDefault(voice => voice.Material == texture.Material && voice.Kind == kind && voice.Thickness == texture.Thickness);
            if (current != null)
            {
                current.Motion = texture;
                current.Aim = texture.Gain;
            }
            else if (textures.Count <= feel.Rules.MaxFadingTextures)
            {
                voices.Add(new Voice(new Texture(feel, kind, texture, rate), texture, kind, 0.0, texture.Gain));
            }
        }

        private void FollowPress()
        {
            List<Voice> yielding = voices.FindAll(voice => voice.Source is Grains);
            foreach (Voice voice in yielding) voice.Aim = 0.0;
            if (press == null) return;
            Voice current = yielding.Find(voice => voice.Material == press.Material);
            if (current == null)
            {
                current = new Voice(new Grains(feel, press, rate), press, "grains", press.Gain, press.Gain);
                voices.Add(current);
            }
            current.Motion = press;
            current.Aim = press.Gain;
        }

        private void FollowHum()
        {
            List<Voice> humming = voices.FindAll(voice => voice.Source is Tone);
            foreach (Voice voice in humming)
            {
                voice.Aim = hum == null ? 0.0 : hum.Level;
                if (hum != null) ((Tone)voice.Source).Hum = hum;
            }
            if (hum != null && humming.Count == 0) voices.Add(new Voice(new Tone(feel.Rules, hum, rate), new Command(), "hum", 0.0, hum.Level));
        }
    }

    /// <summary>One source with a gain that fades towards its aim: voice.py.</summary>
    internal sealed class Voice
    {
        public readonly string Material, Kind;
        public readonly double? Thickness;
        public Source Source;
        public Command Motion;
        public double Gain, Aim;
        public bool Ended;

        public Voice(Source source, Command command, string kind, double gain, double aim)
        {
            Source = source;
            Motion = command;
            Material = command.Material;
            Thickness = command.Thickness;
            Kind = kind;
            Gain = gain;
            Aim = aim;
        }

        public Voice Fork()
        {
            var forked = (Voice)MemberwiseClone();
            forked.Source = Source.Fork();
            return forked;
        }

        public void AddTo(double[] part, double step)
        {
            var block = new double[part.Length];
            Source.Render(block, Motion);
            for (int at = 0; at < part.Length; at++)
            {
                if (Gain < Aim) Gain = Math.Min(Gain + step, Aim);
                else if (Gain > Aim) Gain = Math.Max(Gain - step, Aim);
                part[at] += Gain * block[at];
            }
            Ended = Source.Ended || (Gain == 0.0 && Aim == 0.0);
        }
    }

    /// <summary>Keeps a sequence of blocks within the ceiling, with look-ahead: `Limiter` of voices.py.</summary>
    internal sealed class Limiter
    {
        private readonly int delay;
        private readonly double ceiling, fall;
        private readonly double[] window;
        private double[] delayed, reductions;

        public Limiter(Table rules, int rate)
        {
            delay = (int)Math.Round(rules.Number("delay_s") * rate);
            ceiling = rules.Number("ceiling");
            fall = Math.Exp(-1.0 / (rules.Number("release_s") * rate));
            window = new double[delay + 1];
            for (int at = 0; at <= delay; at++) window[at] = Math.Sin(Math.PI * (at + 1) / (delay + 2));
            double total = window.Sum();
            for (int at = 0; at <= delay; at++) window[at] /= total;
            delayed = new double[delay];
            reductions = new double[2 * delay];
        }

        public bool IsEmpty
        {
            get { return Array.TrueForAll(delayed, sample => sample == 0.0); }
        }

        public Limiter Fork()
        {
            return (Limiter)MemberwiseClone(); // arrays are replaced, never changed
        }

        public void Apply(double[] part)
        {
            int count = part.Length;
            var line = new double[delay + count];
            Array.Copy(delayed, line, delay);
            Array.Copy(part, 0, line, delay, count);
            bool isQuiet = Synthesis.Peak(part, 0, count) <= ceiling && Array.TrueForAll(reductions, value => value == 0.0);
            delayed = Synthesis.Slice(line, count, delay);
            Array.Copy(line, part, count);
            if (isQuiet) return;
            var needs = new double[2 * delay + count];
            Array.Copy(reductions, needs, 2 * delay);
            for (int at = 0; at < count; at++)
            {
                double needed = 1.0 - ceiling / Math.Max(Math.Abs(line[delay + at]), ceiling);
                needs[2 * delay + at] = Math.Max(needed, needs[2 * delay + at - 1] * fall);
            }
            reductions = Synthesis.Slice(needs, count, 2 * delay);
            if (Synthesis.Peak(reductions, 0, reductions.Length) < Smoothed.Negligible) reductions = new double[2 * delay];
            for (int at = 0; at < count; at++)
            {
                double gain = 1.0;
                for (int after = 0; after <= delay; after++) gain -= window[after] * Synthesis.Peak(needs, at + after, delay + 1);
                part[at] *= gain;
            }
        }
    }
}
