using System;

namespace HapticVLM.Baked
{
    /// <summary>What a voice plays. Impacts and grains sound once.</summary>
    internal enum Sort
    {
        Impact,
        Grain,
        Layer,
        Breaks,
        Press,
        Hum,
    }

    /// <summary>A value that follows its target through two low-passes.</summary>
    internal struct Smooth
    {
        public double Value, Slope;

        /// <summary>`time` is in units of the time constant.</summary>
        public void Follow(double target, double time)
        {
            double distance = Value - target, push = Slope + distance, decay = Math.Exp(-time);
            Value = target + (distance + push * time) * decay;
            Slope = (Slope - push * time) * decay;
        }
    }

    /// <summary>What a touch wants to sound. Voices of the same key and thinness follow it; impacts and grains have none.</summary>
    internal struct Wish
    {
        public object Key; // a Format.Texture, the Format.MaterialFeel of a press, or that of hums
        public double Thin, Aim, Speed, Force, Hertz; // Force of a press: its depth
        public Wave Grain, Again;
        public double[] Drives;
    }

    /// <summary>Something that sounds. `Fade` moves to `Aim`; at 0 with aim 0 it ends. A struct, so that rendering takes no memory.</summary>
    internal struct Voice
    {
        public Sort Sort;
        public Wish To;
        public double Fade, Aim;
        public Wave Wave, Next; // of an impact, Share of the next one
        public double Share, At, Rate, Palm, Pad, Most, Hz;
        public bool IsNew, HasBegun; // IsNew: for a plan
        public double[][] Table; // its level by speed and force
        public double Factor;
        public Smooth Flow, Level; // Level of a press: its depth
        public double Crossing, RestS; // the place of the next grain, and s until it may begin
        public int Order; // of a harmonic, from 1, or of a layer, from 0
    }

    /// <summary>One hand: its lease, its hold, and what sounds.</summary>
    internal sealed class Hand
    {
        public bool IsHeld, IsArmed, IsMuted, Touches;
        public double? LeaseUntil, Time; // Time until which a plan has let it sound
        public double TouchedAt;
        public int Gaps, Count;
        public Voice[] Voices = new Voice[32];

        public bool IsActive
        {
            get { return Count > 0; }
        }

        public void Add(Voice voice)
        {
            if (Count == Voices.Length) Array.Resize(ref Voices, 2 * Count);
            Voices[Count++] = voice;
        }

        /// <summary>Drops the voices that ended.</summary>
        public void Drop()
        {
            int kept = 0;
            for (int at = 0; at < Count; at++)
            {
                if (Voices[at].Fade != 0.0 || Voices[at].Aim != 0.0) Voices[kept++] = Voices[at];
            }
            Count = kept;
        }

        /// <summary>Becomes a copy that may sound ahead.</summary>
        public void Take(Hand other)
        {
            if (Voices.Length < other.Voices.Length) Voices = new Voice[other.Voices.Length];
            Array.Copy(other.Voices, Voices, Count = other.Count);
        }
    }

    /// <summary>A place on an axis: the entry below it and the share of the next one. Beyond the ends it is the end.</summary>
    internal struct Place
    {
        private int at;
        private double share;

        public static Place On(double[] axis, double value)
        {
            int at = 0;
            while (at < axis.Length - 2 && axis[at + 1] <= value) at++;
            return new Place { at = at, share = Math.Min(Math.Max((value - axis[at]) / (axis[at + 1] - axis[at]), 0.0), 1.0) };
        }

        public double In(double[] table)
        {
            return table[at] + share * (table[at + 1] - table[at]);
        }

        public double In(double[][] table, Place by)
        {
            double low = by.In(table[at]);
            return low + share * (by.In(table[at + 1]) - low);
        }
    }
}
