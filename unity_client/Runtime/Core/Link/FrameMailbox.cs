using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Holds the newest frame that was not sent yet. Three buffers change places, so that nobody waits
    /// and nothing is copied or allocated: one is written, one waits, one is being sent.
    /// </summary>
    public sealed class FrameMailbox
    {
        readonly object gate = new object();
        MsgPackWriter writing = new MsgPackWriter(65536);
        MsgPackWriter waiting = new MsgPackWriter(65536);
        MsgPackWriter sending = new MsgPackWriter(65536);
        bool isFull;
        long dropped;

        /// <summary>Frames that a newer one replaced before they were sent.</summary>
        public long Dropped { get { return Interlocked.Read(ref dropped); } }

        public bool IsFull { get { lock (gate) return isFull; } }

        /// <summary>Where the one producer writes its next message.</summary>
        public MsgPackWriter Begin()
        {
            writing.Reset();
            return writing;
        }

        /// <summary>Makes what was written the newest frame.</summary>
        public void Publish()
        {
            lock (gate)
            {
                if (isFull) dropped++;
                MsgPackWriter free = waiting;
                waiting = writing;
                writing = free;
                isFull = true;
            }
        }

        /// <summary>The newest frame, or null. Valid until the next call.</summary>
        public MsgPackWriter Take()
        {
            lock (gate)
            {
                if (!isFull) return null;
                MsgPackWriter free = sending;
                sending = waiting;
                waiting = free;
                isFull = false;
                return sending;
            }
        }

        public void Clear()
        {
            lock (gate) isFull = false;
        }
    }
}
