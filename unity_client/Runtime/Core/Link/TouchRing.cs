using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// A queue of unsent touches, oldest first. Contact and release are never dropped. Approach and slide
    /// are renewals: the newest of a hand replaces a waiting one, and a full ring drops a renewal first.
    /// </summary>
    public sealed class TouchRing
    {
        readonly object gate = new object();
        readonly Touch[] touches;
        int first;
        int count;
        long superseded;

        public TouchRing(int capacity = 256)
        {
            touches = new Touch[capacity];
        }

        public int Count { get { lock (gate) return count; } }

        /// <summary>Renewals replaced by a newer one, or dropped to make room.</summary>
        public long Superseded { get { lock (gate) return superseded; } }

        /// <summary>Adds a touch; false if the ring is full of contacts and releases.</summary>
        public bool Add(ref Touch touch)
        {
            lock (gate)
            {
                if (IsRenewal(touch.Phase) && Supersede(ref touch)) return true;
                if (count == touches.Length && !DisplaceRenewal()) return false;
                touches[(first + count++) % touches.Length] = touch;
                return true;
            }
        }

        public bool Take(out Touch touch)
        {
            lock (gate)
            {
                touch = touches[first];
                if (count == 0) return false;
                first = (first + 1) % touches.Length;
                count--;
                return true;
            }
        }

        public void Clear()
        {
            lock (gate) count = 0;
        }

        static bool IsRenewal(Phase phase)
        {
            return phase == Phase.Approach || phase == Phase.Slide;
        }

        /// <summary>Replaces the last waiting touch of this hand if it is a renewal as well.</summary>
        bool Supersede(ref Touch touch)
        {
            for (int i = count - 1; i >= 0; i--)
            {
                int at = (first + i) % touches.Length;
                if (touches[at].Hand != touch.Hand) continue;
                if (!IsRenewal(touches[at].Phase)) return false;
                touches[at] = touch;
                superseded++;
                return true;
            }
            return false;
        }

        bool DisplaceRenewal()
        {
            for (int i = 0; i < count; i++)
            {
                if (!IsRenewal(touches[(first + i) % touches.Length].Phase)) continue;
                for (int j = i; j < count - 1; j++)
                    touches[(first + j) % touches.Length] = touches[(first + j + 1) % touches.Length];
                count--;
                superseded++;
                return true;
            }
            return false;
        }
    }
}
