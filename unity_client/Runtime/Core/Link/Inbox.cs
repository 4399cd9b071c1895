using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// A bounded queue of received messages for the main thread, stored as bytes in reused buffers. It
    /// holds only the newest telemetry. When it is full, the oldest message is dropped and counted.
    /// </summary>
    public sealed class Inbox
    {
        struct Slot
        {
            public byte[] Bytes;
            public int Length;
            public Kind Kind;
        }

        readonly object gate = new object();
        readonly Slot[] slots;
        int first;
        int count;
        long dropped;
        byte[] taken = new byte[1024];

        public Inbox(int capacity = 256)
        {
            slots = new Slot[capacity];
            for (int i = 0; i < capacity; i++) slots[i].Bytes = new byte[1024];
        }

        public long Dropped { get { lock (gate) return dropped; } }

        public void Add(ArraySegment<byte> message, Kind kind)
        {
            lock (gate)
            {
                int at = kind == Kind.Telemetry ? WaitingTelemetry() : -1;
                if (at < 0)
                {
                    if (count == slots.Length) DropOldest();
                    at = (first + count++) % slots.Length;
                }
                if (slots[at].Bytes.Length < message.Count) slots[at].Bytes = new byte[message.Count * 2];
                Buffer.BlockCopy(message.Array, message.Offset, slots[at].Bytes, 0, message.Count);
                slots[at].Length = message.Count;
                slots[at].Kind = kind;
            }
        }

        /// <summary>Takes the oldest message; its bytes stay valid until the next call.</summary>
        public bool Take(out ArraySegment<byte> message, out Kind kind)
        {
            lock (gate)
            {
                message = default(ArraySegment<byte>);
                kind = Kind.Other;
                if (count == 0) return false;
                byte[] free = taken;
                taken = slots[first].Bytes;
                slots[first].Bytes = free;
                message = new ArraySegment<byte>(taken, 0, slots[first].Length);
                kind = slots[first].Kind;
                first = (first + 1) % slots.Length;
                count--;
                return true;
            }
        }

        int WaitingTelemetry()
        {
            for (int i = count - 1; i >= 0; i--)
            {
                int at = (first + i) % slots.Length;
                if (slots[at].Kind == Kind.Telemetry) return at;
            }
            return -1;
        }

        void DropOldest()
        {
            first = (first + 1) % slots.Length;
            count--;
            dropped++;
        }
    }
}
