using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Holds the newest frame that was not sent yet. Three buffers rotate, so that no thread waits and
    /// nothing is copied or allocated: one is being written, one is waiting, one is being sent.
    /// </summary>
    public sealed class FrameMailbox
    {
        readonly object gate = new object();
        MsgPackWriter writing = new MsgPackWriter(65536);
        MsgPackWriter waiting = new MsgPackWriter(65536);
        MsgPackWriter sending = new MsgPackWriter(65536);
        bool isFull;
        long dropped;

        /// <summary>Frames replaced by a newer one before they were sent.</summary>
        public long Dropped { get { return Interlocked.Read(ref dropped); } }

        public bool IsFull { get { lock (gate) return isFull; } }

        /// <summary>Returns the buffer for the next frame. Only one producer may use it.</summary>
        public MsgPackWriter Begin()
        {
            writing.Reset();
            return writing;
        }

        /// <summary>Publishes the frame written since Begin as the newest.</summary>
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

        /// <summary>Takes the newest frame, or null. It stays valid until the next call.</summary>
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
