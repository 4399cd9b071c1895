namespace HapticVLM.Baked
{
    /// <summary>What is felt of a touched surface: a surface of `materials.json`. Material null: nothing.</summary>
    public sealed class FeltSurface
    {
        public string Material;
        public double ImpactGain = 1.0;
        public double? ThicknessM;
        public FeltHum Hum;
    }

    /// <summary>The hum of a thing that runs: Hz, level 0..1, amplitude of each harmonic.</summary>
    public sealed class FeltHum
    {
        public double? FrequencyHz;
        public double? Level;
        public double[] Drives;
    }

    /// <summary>One touch, with the words of the protocol. Interaction null: strike at contact, slide while sliding. Speed null: 0 m/s, force null: 1.5 N.</summary>
    public struct FeltTouch
    {
        public string Phase;
        public string Hand;
        public string Interaction;
        public double? SpeedMps;
        public double? ForceN;
        public FeltSurface Surface;
    }

    /// <summary>An impact that begins now.</summary>
    public struct FeltTransient
    {
        public double Amplitude;
        public double FrequencyHz;
    }

    /// <summary>The next moments of a hand, as a `vibration` event; empty arrays are silence.</summary>
    public sealed class FeltPlan
    {
        public double PeriodS;
        public double[] Amplitude = new double[0];
        public double[] FrequencyHz = new double[0];
        public FeltTransient[] Transients = new FeltTransient[0];
    }
}
