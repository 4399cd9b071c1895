using System;

namespace HapticVLM
{
    /// <summary>How long to wait before the next try: doubling, with jitter, so that clients spread.</summary>
    public sealed class Backoff
    {
        readonly double first;
        readonly double most;
        readonly Random random;
        int tries;

        public Backoff(double firstS, double mostS, int seed)
        {
            first = firstS;
            most = mostS;
            random = new Random(seed);
        }

        /// <summary>Seconds to wait now: between half and all of first * 2^tries, at most mostS.</summary>
        public double Next()
        {
            double all = Math.Min(most, first * Math.Pow(2.0, Math.Min(tries++, 30)));
            return all * (0.5 + 0.5 * random.NextDouble());
        }

        public void Reset()
        {
            tries = 0;
        }
    }
}
