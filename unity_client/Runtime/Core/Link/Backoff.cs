using System;

namespace HapticVLM
{
    /// <summary>Exponential back-off with jitter, so that many clients do not reconnect at the same moment.</summary>
    public sealed class Backoff
    {
        readonly double first;
        readonly double longest;
        readonly Random random;
        int tries;

        public Backoff(double firstS, double longestS, int seed)
        {
            first = firstS;
            longest = longestS;
            random = new Random(seed);
        }

        /// <summary>Returns the next wait in seconds: between 50 % and 100 % of first * 2^tries, at most longestS.</summary>
        public double Next()
        {
            double full = Math.Min(longest, first * Math.Pow(2.0, Math.Min(tries++, 30)));
            return full * (0.5 + 0.5 * random.NextDouble());
        }

        public void Reset()
        {
            tries = 0;
        }
    }
}
