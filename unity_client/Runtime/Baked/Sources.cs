using System;

namespace HapticVLM.Baked
{
    /// <summary>What a voice plays: adds its next samples to a block.</summary>
    internal abstract class Source
    {
        public virtual bool Ended
        {
            get { return false; }
        }

        /// <summary>An independent copy in the same state.</summary>
        public virtual Source Fork()
        {
            return (Source)MemberwiseClone();
        }

        public abstract void Render(double[] block, Command motion);
    }

    /// <summary>An impact that was computed as a whole.</summary>
    internal sealed class Played : Source
    {
        public readonly double Peak;
        public int At;
        private readonly double[] wave;

        public Played(double[] wave)
        {
            this.wave = wave;
            Peak = Synthesis.Peak(wave, 0, wave.Length);
        }

        public override bool Ended
        {
            get { return At >= wave.Length; }
        }

        public override void Render(double[] block, Command motion)
        {
            int count = Math.Min(block.Length, wave.Length - At);
            if (count > 0) Array.Copy(wave, At, block, 0, count);
            At += block.Length;
        }
    }

    /// <summary>Sliding, carving and swinging: textures.py.</summary>
    internal sealed class Texture : Source
    {
        private readonly Table rules;
        private readonly string kind;
        private readonly double roughness, period, stick;
        private readonly double[] slipsHz;
        private Reader surface, slips;
        private Breaks breaks;

        public Texture(Feel feel, string kind, Command command, int rate)
        {
            FeltMaterial facts = feel.Find(command.Material);
            Draws draws = feel.Draws(command.Seed);
            rules = feel.Rules.Textures;
            slipsHz = rules.Numbers("slips_hz");
            this.kind = kind;
            bool swings = kind == "swing";
            roughness = swings ? 1.0 : facts.Roughness;
            period = swings ? (command.Thickness ?? facts.ThicknessM) / rules.Number("strouhal") : facts.PeriodM;
            stick = swings ? 0.0 : kind == "carve" ? facts.CarveStick : facts.SlideStick;
            surface = new Reader(swings ? facts.Swing : facts.Slide, draws.Next(), feel.Rules, rate);
            if (stick > 0.0) slips = new Reader(feel.Slips, draws.Next(), feel.Rules, rate);
            if (kind == "carve" && facts.FibreM != null) breaks = new Breaks(facts, draws, feel.Rules, rate);
        }

        public override Source Fork()
        {
            var forked = (Texture)base.Fork();
            forked.surface = surface.Fork();
            forked.slips = slips == null ? null : slips.Fork();
            forked.breaks = breaks == null ? null : breaks.Fork();
            return forked;
        }

        public override void Render(double[] block, Command motion)
        {
            double moved = Share(motion.Speed, motion.Force), caught = Caught(motion.Speed, motion.Force);
            double centre = Math.Max(Synthesis.Bent(motion.Speed / period, rules), rules.Number("lowest_hz"));
            surface.AddTo(block, centre, moved * roughness * Math.Sqrt(1.0 - caught * caught));
            double slipHz = Math.Min(Math.Max(motion.Speed / rules.Number("slip_m"), slipsHz[0]), slipsHz[1]);
            if (slips != null) slips.AddTo(block, slipHz, moved * caught);
            if (breaks == null) return;
            double rub = rules.Number("carve_rub");
            for (int at = 0; at < block.Length; at++) block[at] *= rub;
            breaks.AddTo(block, moved, motion.Speed);
        }

        /// <summary>Share of its full strength that it reaches by this speed and force.</summary>
        private double Share(double speed, double force)
        {
            double swing = rules.Number("swing_speed_mps");
            if (kind == "swing") return 1.0 - Math.Exp(-speed * speed / (swing * swing));
            double pressed = 0.3 + 0.7 * force / (force + rules.Number("light_force_n"));
            return pressed * speed / (speed + rules.Number("slow_speed_mps"));
        }

        /// <summary>Share of the surface that catches and slips.</summary>
        private double Caught(double speed, double force)
        {
            double held = stick * force / (force + rules.Number("stuck_n"));
            double limit = rules.Number("catch_mps") * held;
            return limit == 0.0 ? 0.0 : held * limit * limit / (limit * limit + speed * speed);
        }
    }

    /// <summary>Reads a loop at a rate and a level that follow their targets.</summary>
    internal sealed class Reader
    {
        private readonly Loop loop;
        private readonly Rules rules;
        private readonly int rate;
        private readonly double rms;
        private double at;
        private bool hasCentre;
        private Smoothed centre, level;

        public Reader(Loop loop, double place, Rules rules, int rate)
        {
            this.loop = loop;
            this.rules = rules;
            this.rate = rate;
            rms = rules.Textures.Number("rms");
            at = place * loop.Wave.Length;
            level = new Smoothed(0.0, rules, rate);
        }

        public Reader Fork()
        {
            return (Reader)MemberwiseClone();
        }

        public void AddTo(double[] block, double centreHz, double strength)
        {
            if (!hasCentre) centre = new Smoothed(centreHz, rules, rate);
            hasCentre = true;
            double target = rms * strength * Synthesis.Interpolated(centreHz, rules.GridHz, loop.Drive);
            double perHz = loop.PerPeriod / rate;
            for (int sample = 0; sample < block.Length; sample++)
            {
                at = (at + centre.Step(centreHz) * perHz) % loop.Wave.Length;
                block[sample] += loop.Read(at) * level.Step(target);
            }
            centre.Settle(centreHz);
            level.Settle(target);
        }
    }

    /// <summary>Fibre breaks under a blade.</summary>
    internal sealed class Breaks
    {
        private readonly int rate;
        private readonly double spacing;
        private readonly double[] limitsHz, grain;
        private Draws draws;
        private double[] tail;
        private double toNext; // in mean spacings
        private Smoothed level;

        public Breaks(FeltMaterial facts, Draws draws, Rules rules, int rate)
        {
            this.draws = draws;
            this.rate = rate;
            spacing = facts.FibreM.Value;
            limitsHz = rules.Textures.Numbers("breaks_hz");
            grain = Synthesis.Grain(facts.Grain, rules, rate);
            tail = new double[grain.Length];
            toNext = this.draws.Next();
            level = new Smoothed(0.0, rules, rate);
        }

        public Breaks Fork()
        {
            return (Breaks)MemberwiseClone(); // the tail is replaced, never changed
        }

        public void AddTo(double[] block, double target, double speed)
        {
            int count = block.Length;
            double[] levels = level.Block(target, count);
            var all = new double[count + grain.Length];
            Array.Copy(tail, all, tail.Length);
            double perSample = speed > 0.0 ? Math.Min(Math.Max(speed / spacing, limitsHz[0]), limitsHz[1]) / rate : 0.0;
            toNext -= perSample * count;
            while (toNext < 0.0)
            {
                int begin = Math.Max(count + (int)Math.Floor(toNext / perSample), 0);
                double strength = (0.4 + 0.6 * draws.Next()) * levels[begin];
                for (int at = 0; at < grain.Length; at++) all[begin + at] += strength * grain[at];
                toNext += 0.5 + draws.Next();
            }
            for (int at = 0; at < count; at++) block[at] += all[at];
            tail = Synthesis.Slice(all, count, grain.Length);
        }
    }

    /// <summary>A press on something that yields: grains.py.</summary>
    internal sealed class Grains : Source
    {
        private readonly double perGrain, back;
        private readonly double[] grain;
        private readonly int gap;
        private double[] tail;
        private double next;
        private int rest;
        private Smoothed depth;

        public Grains(Feel feel, Command command, int rate)
        {
            FeltMaterial facts = feel.Find(command.Material);
            Table rules = feel.Rules.Press;
            double strength = rules.Number("strength");
            perGrain = facts.PressNPerGrain.Value;
            back = rules.Number("back");
            grain = Array.ConvertAll(Synthesis.Grain(facts.Grain, feel.Rules, rate), sample => strength * sample);
            gap = (int)Math.Round(rate / rules.Number("max_rate_hz"));
            tail = new double[grain.Length];
            next = 0.3 + 0.4 * feel.Draws(command.Seed).Next();
            depth = new Smoothed(0.0, feel.Rules, rate);
        }

        public override void Render(double[] block, Command motion)
        {
            int count = block.Length;
            var all = new double[count + grain.Length];
            Array.Copy(tail, all, tail.Length);
            double[] depths = depth.Block(motion.Force / perGrain, count);
            for (int at = rest; at < count; at++)
            {
                if (depths[at] < next) continue;
                for (int after = 0; after < grain.Length; after++) all[at + after] += grain[after];
                next += Math.Floor(depths[at] - next) + 1.0;
                rest = at + gap;
                at = rest - 1;
            }
            double left = next - 1.0 - depths[count - 1] - back;
            if (left > 0.0) next -= Math.Floor(left) + 1.0;
            rest = Math.Max(rest - count, 0);
            Array.Copy(all, block, count);
            tail = Synthesis.Slice(all, count, grain.Length);
        }
    }

    /// <summary>The hum of a thing that runs: hum.py.</summary>
    internal sealed class Tone : Source
    {
        public FeltHum Hum;
        private readonly int rate;
        private double turns;
        private Smoothed pitch;

        public Tone(Rules rules, FeltHum hum, int rate)
        {
            Hum = hum;
            this.rate = rate;
            pitch = new Smoothed(hum.FrequencyHz, rules, rate);
        }

        public override void Render(double[] block, Command motion)
        {
            for (int at = 0; at < block.Length; at++)
            {
                turns = (turns + pitch.Step(Hum.FrequencyHz) / rate) % 1.0;
                for (int order = 0; order < Hum.Drives.Length; order++) block[at] += Hum.Drives[order] * Math.Sin(2.0 * Math.PI * (order + 1) * turns);
            }
            pitch.Settle(Hum.FrequencyHz);
        }
    }
}
