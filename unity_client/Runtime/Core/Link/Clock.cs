using System.Diagnostics;

namespace HapticVLM
{
    /// <summary>Seconds that only grow, the same on all threads: the clock of captured_at.</summary>
    public static class Clock
    {
        public static double Now { get { return (double)Stopwatch.GetTimestamp() / Stopwatch.Frequency; } }
    }
}
