using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Touches that wait to be sent, oldest first. Contact and release are never dropped. Approach and
    /// slide only renew: of one hand the newest replaces the one that waits, and makes room if need be.
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

        /// <summary>Renewals that a newer one replaced or a contact or release displaced.</summary>
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

        /// <summary>Replaces this hand's last waiting touch if that one only renews, too.</summary>
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
