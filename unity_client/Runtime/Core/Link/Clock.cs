using System.Diagnostics;

namespace HapticVLM
{
    /// <summary>A monotonic clock in seconds, the same on all threads; captured_at is a time of it.</summary>
    public static class Clock
    {
        public static double Now { get { return (double)Stopwatch.GetTimestamp() / Stopwatch.Frequency; } }
    }
}
