using System.Threading;

namespace HapticVLM
{
    /// <summary>Issues request ids from 1 upwards; safe on any thread.</summary>
    public sealed class RequestIds
    {
        long last;

        public long Next()
        {
            return Interlocked.Increment(ref last);
        }
    }
}
