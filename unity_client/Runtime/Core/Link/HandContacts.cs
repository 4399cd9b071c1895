using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The contacts of one hand, the newest last. A contact is identified by the finger and the
    /// collider it met. Allocates nothing after construction.
    /// </summary>
    internal sealed class HandContacts
    {
        const int Capacity = 64;

        struct Contact
        {
            public object Finger;
            public object Met;
            public string ObjectId;
            public double SpeedMps;
            public double ForceN;
            public int? Surface;
        }

        readonly Contact[] contacts = new Contact[Capacity];

        public int Count { get; private set; }

        /// <summary>Id of the object touched last; null when the hand touches nothing.</summary>
        public string ObjectId { get { return Count > 0 ? contacts[Count - 1].ObjectId : null; } }

        /// <summary>Speed of the newest contact, m/s.</summary>
        public double NewestSpeedMps { get { return contacts[Count - 1].SpeedMps; } }

        public object Finger(int index)
        {
            return contacts[index].Finger;
        }

        public object Met(int index)
        {
            return contacts[index].Met;
        }

        public string MetId(int index)
        {
            return contacts[index].ObjectId;
        }

        /// <summary>Adds a contact; false if it exists already or the list is full.</summary>
        public bool Add(object finger, object met, string objectId, double speedMps, double forceN, int? surface)
        {
            if (Find(finger, met) >= 0 || Count == Capacity) return false;
            contacts[Count++] = new Contact { Finger = finger, Met = met, ObjectId = objectId, SpeedMps = speedMps, ForceN = forceN, Surface = surface };
            return true;
        }

        public void Follow(object finger, object met, double speedMps, double forceN, int? surface)
        {
            int at = Find(finger, met);
            if (at < 0) return;
            contacts[at].SpeedMps = speedMps;
            contacts[at].ForceN = forceN;
            contacts[at].Surface = surface;
        }

        /// <summary>Removes a contact; false if it does not exist.</summary>
        public bool Remove(object finger, object met)
        {
            int at = Find(finger, met);
            if (at < 0) return false;
            Array.Copy(contacts, at + 1, contacts, at, Count - at - 1);
            contacts[--Count] = default(Contact);
            return true;
        }

        public void Clear()
        {
            Array.Clear(contacts, 0, Count);
            Count = 0;
        }

        /// <summary>Fills in the object and surface touched last, and the greatest speed and force of all contacts with it.</summary>
        public void Fill(ref Touch touch)
        {
            double speed = 0.0, force = 0.0;
            touch.ObjectId = ObjectId;
            touch.Surface = Count > 0 ? contacts[Count - 1].Surface : null;
            for (int i = 0; i < Count; i++)
            {
                if (contacts[i].ObjectId != touch.ObjectId) continue;
                speed = Math.Max(speed, Within(contacts[i].SpeedMps, Touch.SpeedMpsMax));
                force = Math.Max(force, Within(contacts[i].ForceN, Touch.ForceNMax));
            }
            touch.SpeedMps = speed;
            touch.ForceN = force;
        }

        internal static double Within(double value, double limit)
        {
            return value > 0.0 ? Math.Min(value, limit) : 0.0; // NaN counts as 0
        }

        int Find(object finger, object met)
        {
            for (int i = 0; i < Count; i++)
            {
                if (ReferenceEquals(contacts[i].Met, met) && ReferenceEquals(contacts[i].Finger, finger)) return i;
            }
            return -1;
        }
    }
}
