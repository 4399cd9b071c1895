using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// What the fingers of one hand are in contact with, the newest last. A contact is known by who
    /// met it (a finger) and what it met (a collider). No allocation after the first.
    /// </summary>
    internal sealed class HandContacts
    {
        const int Most = 64;

        struct Contact
        {
            public object Finger;
            public object Met;
            public string ObjectId;
            public double SpeedMps;
            public double ForceN;
        }

        readonly Contact[] contacts = new Contact[Most];

        public int Count { get; private set; }

        /// <summary>What is touched: the object met last; null when none is.</summary>
        public string ObjectId { get { return Count > 0 ? contacts[Count - 1].ObjectId : null; } }

        /// <summary>How fast the newest contact is.</summary>
        public double NewestSpeedMps { get { return contacts[Count - 1].SpeedMps; } }

        public object Finger(int index)
        {
            return contacts[index].Finger;
        }

        public object Met(int index)
        {
            return contacts[index].Met;
        }

        /// <summary>Adds a contact; false when it is there already, or one too many.</summary>
        public bool Add(object finger, object met, string objectId, double speedMps, double forceN)
        {
            if (Find(finger, met) >= 0 || Count == Most) return false;
            contacts[Count++] = new Contact { Finger = finger, Met = met, ObjectId = objectId, SpeedMps = speedMps, ForceN = forceN };
            return true;
        }

        public void Follow(object finger, object met, double speedMps, double forceN)
        {
            int at = Find(finger, met);
            if (at < 0) return;
            contacts[at].SpeedMps = speedMps;
            contacts[at].ForceN = forceN;
        }

        /// <summary>Removes a contact; false when it was not there.</summary>
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

        /// <summary>Of all contacts with the target the fastest and the hardest count.</summary>
        public void Fill(ref Touch touch)
        {
            double speed = 0.0, force = 0.0;
            touch.ObjectId = ObjectId;
            for (int i = 0; i < Count; i++)
            {
                if (contacts[i].ObjectId != touch.ObjectId) continue;
                speed = Math.Max(speed, Within(contacts[i].SpeedMps, Touch.SpeedMpsMax));
                force = Math.Max(force, Within(contacts[i].ForceN, Touch.ForceNMax));
            }
            touch.SpeedMps = speed;
            touch.ForceN = force;
        }

        internal static double Within(double value, double most)
        {
            return value > 0.0 ? Math.Min(value, most) : 0.0; // NaN is no speed
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
