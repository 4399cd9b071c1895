using System.Threading;

namespace HapticVLM
{
    /// <summary>Counts requests from 1, on any thread.</summary>
    public sealed class RequestIds
    {
        long last;

        public long Next()
        {
            return Interlocked.Increment(ref last);
        }
    }
}
