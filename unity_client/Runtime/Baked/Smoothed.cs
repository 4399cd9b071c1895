using System;

namespace HapticVLM.Baked
{
    /// <summary>A value that follows its target through two low-passes: smoothing.py, one sample at a time.</summary>
    internal struct Smoothed
    {
        public const double Negligible = 1e-6;
        private readonly double time, decay;
        private double value, slope;

        public Smoothed(double value, Rules rules, int rate)
        {
            this.value = value;
            slope = 0.0;
            time = 1.0 / (rules.SmoothS * rate);
            decay = Math.Exp(-time);
        }

        public double Step(double target)
        {
            double distance = value - target, push = slope + distance;
            value = target + (distance + push * time) * decay;
            slope = (slope - push * time) * decay;
            return value;
        }

        public void Settle(double target)
        {
            if (Math.Abs(value - target) >= Negligible || Math.Abs(slope) >= Negligible) return;
            value = target;
            slope = 0.0;
        }

        public double[] Block(double target, int count)
        {
            var values = new double[count];
            for (int at = 0; at < count; at++) values[at] = Step(target);
            Settle(target);
            return values;
        }
    }
}
