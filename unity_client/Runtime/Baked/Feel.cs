using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>The tables of `feel.json`, opened. Several players share one.</summary>
    public sealed class Feel
    {
        private const double Version = 1;
        internal readonly Rules Rules;
        internal readonly Loop Slips;
        internal readonly double[] Weights;
        private readonly Dictionary<string, FeltMaterial> materials = new Dictionary<string, FeltMaterial>();
        private readonly double[] drawn;
        private readonly int seeds;

        private Feel(Table file)
        {
            if (file.Number("version") != Version)
            {
                throw new FormatException("feel.json: version " + file.Number("version") + " is not " + Version + "; bake it again, or update the client");
            }
            Rules = new Rules(file.Part("rules"));
            Slips = new Loop(file.Part("slips"));
            Weights = Synthesis.Weights(Rules);
            seeds = (int)file.Number("seeds");
            byte[] draws = Convert.FromBase64String(file.Text("draws"));
            drawn = new double[draws.Length / 2];
            for (int at = 0; at < drawn.Length; at++) drawn[at] = (draws[2 * at] + 256 * draws[2 * at + 1] + 0.5) / 65536.0;
            Table all = file.Part("materials");
            foreach (string name in all.Names) materials[name] = new FeltMaterial(all.Part(name));
        }

        /// <summary>The names of the materials in it.</summary>
        public IEnumerable<string> Materials
        {
            get { return materials.Keys; }
        }

        /// <summary>Adds the materials of another file that are missing in this one.</summary>
        public void Complete(Feel with)
        {
            foreach (KeyValuePair<string, FeltMaterial> each in with.materials)
            {
                if (!materials.ContainsKey(each.Key)) materials[each.Key] = each.Value;
            }
        }

        /// <summary>Opens the contents of `feel.json`. Throws FormatException, which names the field.</summary>
        public static Feel Open(string json)
        {
            return new Feel(new Table("feel.json", Json.Parse(json)));
        }

        internal FeltMaterial Find(string name)
        {
            FeltMaterial material;
            return name != null && materials.TryGetValue(name, out material) ? material : null;
        }

        internal Draws Draws(int seed)
        {
            return new Draws(drawn, seed % seeds, drawn.Length / seeds);
        }
    }

    /// <summary>One map of a file; every reading names the field that is missing or of another kind.</summary>
    internal sealed class Table
    {
        private readonly string path;
        private readonly Dictionary<string, object> fields;

        public Table(string path, object value)
        {
            this.path = path;
            fields = value as Dictionary<string, object>;
            if (fields == null) throw new FormatException(path + ": not a map; bake it again");
        }

        public IEnumerable<string> Names
        {
            get { return fields.Keys; }
        }

        public Table Part(string name)
        {
            return new Table(path + "." + name, Read<Dictionary<string, object>>(name));
        }

        public double Number(string name)
        {
            return Read<double>(name);
        }

        public bool Has(string name)
        {
            object value;
            return fields.TryGetValue(name, out value) && value != null;
        }

        public double? Optional(string name)
        {
            object value;
            return fields.TryGetValue(name, out value) && value != null ? (double?)Number(name) : null;
        }

        public string Text(string name)
        {
            return Read<string>(name);
        }

        public List<object> List(string name)
        {
            return Read<List<object>>(name);
        }

        public double[] Numbers(string name)
        {
            return Read<List<object>>(name).ConvertAll(value => (double)value).ToArray();
        }

        public Mode[] Modes(string name)
        {
            return Read<List<object>>(name).ConvertAll(value => new Mode(new Table(path + "." + name, value))).ToArray();
        }

        private T Read<T>(string name)
        {
            object value;
            if (fields.TryGetValue(name, out value) && value is T) return (T)value;
            throw new FormatException(path + "." + name + ": missing or of another kind; bake it again");
        }
    }

    /// <summary>One decaying mode: Hz, 1/s, relative gain.</summary>
    internal struct Mode
    {
        public double FrequencyHz;
        public double DecayPerS;
        public double Gain;

        public Mode(Table table)
        {
            FrequencyHz = table.Number("frequency_hz");
            DecayPerS = table.Number("decay_per_s");
            Gain = table.Number("gain");
        }
    }

    /// <summary>One loop of relief.</summary>
    internal sealed class Loop
    {
        public readonly double PerPeriod;
        public readonly double[] Drive;
        public readonly double[] Wave;

        public Loop(Table table)
        {
            PerPeriod = table.Number("samples");
            Drive = table.Numbers("drive");
            double step = table.Number("step");
            byte[] packed = Convert.FromBase64String(table.Text("wave"));
            Wave = new double[packed.Length];
            for (int at = 0; at < packed.Length; at++) Wave[at] = (sbyte)packed[at] * step;
        }

        /// <summary>The value at a position in samples, by a cubic through the four around it.</summary>
        public double Read(double at)
        {
            int count = Wave.Length;
            int whole = (int)at;
            double share = at - whole;
            double a = Wave[(whole + count - 1) % count], b = Wave[whole % count], c = Wave[(whole + 1) % count], d = Wave[(whole + 2) % count];
            return b + 0.5 * share * (c - a + share * (2 * a - 5 * b + 4 * c - d + share * (3 * (b - c) + d - a)));
        }
    }

    /// <summary>All tables of one material; null: too hard to carve, or does not yield.</summary>
    internal sealed class FeltMaterial
    {
        public readonly Mode[] Modes;
        public readonly Dictionary<string, double[]> LogLevel = new Dictionary<string, double[]>();
        public readonly double PeriodM, Roughness, SlideStick, CarveStick, ThicknessM;
        public readonly double? FibreM, PressNPerGrain;
        public readonly Loop Slide, Swing;
        public readonly Mode Grain;

        public FeltMaterial(Table table)
        {
            Table impact = table.Part("impact"), slide = table.Part("slide"), carve = table.Part("carve"), swing = table.Part("swing");
            Modes = impact.Modes("modes");
            Table levels = impact.Part("log_level");
            foreach (string kind in levels.Names) LogLevel[kind] = levels.Numbers(kind);
            PeriodM = slide.Number("period_m");
            Roughness = slide.Number("roughness");
            SlideStick = slide.Number("stick");
            Slide = new Loop(slide.Part("loop"));
            CarveStick = carve.Number("stick");
            FibreM = carve.Optional("fibre_m");
            ThicknessM = swing.Number("thickness_m");
            Swing = new Loop(swing.Part("loop"));
            Grain = new Mode(table.Part("grain"));
            PressNPerGrain = table.Optional("press_n_per_grain");
        }
    }

    /// <summary>The figures of the equations.</summary>
    internal sealed class Rules
    {
        public readonly double LeaseS;
        public readonly Table Touch, Impacts, Textures, Press, Voices, Plan, Perception;
        public readonly double[] LogContactS, GridHz, ThresholdHz, ThresholdDb;
        public readonly double SmoothS, FadeS;
        public readonly int Chunk, PlanHz, MaxRinging, MaxImpacts, MaxFadingTextures;

        public Rules(Table table)
        {
            LeaseS = table.Number("lease_s");
            Touch = table.Part("touch");
            Impacts = table.Part("impacts");
            Textures = table.Part("textures");
            Press = table.Part("press");
            Voices = table.Part("voices");
            Plan = table.Part("plan");
            Perception = table.Part("perception");
            LogContactS = Impacts.Numbers("log_contact_s");
            GridHz = Textures.Numbers("grid_hz");
            ThresholdHz = Perception.Numbers("threshold_hz");
            ThresholdDb = Perception.Numbers("threshold_db");
            SmoothS = Voices.Number("smooth_s");
            FadeS = Voices.Number("fade_s");
            Chunk = (int)Voices.Number("chunk");
            MaxRinging = (int)Voices.Number("max_ringing");
            MaxImpacts = (int)Voices.Number("max_impacts");
            MaxFadingTextures = (int)Voices.Number("max_fading_textures");
            PlanHz = (int)Plan.Number("rate_hz");
        }
    }

    /// <summary>The random numbers of one seed, as the service draws them.</summary>
    internal struct Draws
    {
        private readonly double[] all;
        private readonly int row, count;
        private int drawn;

        public Draws(double[] all, int row, int count)
        {
            this.all = all;
            this.row = row;
            this.count = count;
            drawn = 0;
        }

        public double Next()
        {
            return all[row * count + drawn++ % count];
        }
    }
}
