using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Turns what one hand's colliders meet into touches: contact at the first, slide to renew the
    /// lease and to change target, release after the last; approach before. After a reconnect it says
    /// again what the hand touches. Keys are whatever tells colliders apart.
    /// </summary>
    public sealed class HandTouches
    {
        const int MostContacts = 16;

        struct Contact
        {
            public object Key;
            public string ObjectId;
            public double SpeedMps;
            public double ForceN;
        }

        readonly HandName hand;
        readonly double periodS;
        readonly Contact[] contacts = new Contact[MostContacts];
        int count;
        string nearId;
        double dueAt;
        int openings;

        public HandTouches(HandName hand, double renewalsPerS)
        {
            this.hand = hand;
            periodS = 1.0 / renewalsPerS;
        }

        public bool IsTouching { get { return count > 0; } }

        /// <summary>What is touched: the object met last; null when none is.</summary>
        public string ObjectId { get { return count > 0 ? contacts[count - 1].ObjectId : null; } }

        public int Count { get { return count; } }

        public object Key(int index)
        {
            return contacts[index].Key;
        }

        public void Begin(object key, string objectId, double speedMps, double forceN, HapticConnection to)
        {
            if (Find(key) >= 0 || count == MostContacts) return;
            contacts[count++] = new Contact { Key = key, ObjectId = objectId, SpeedMps = speedMps, ForceN = forceN };
            nearId = null;
            Send(count == 1 ? Phase.Contact : Phase.Slide, to);
        }

        /// <summary>Follows a contact; what is told goes out with the next renewal.</summary>
        public void Follow(object key, double speedMps, double forceN)
        {
            int at = Find(key);
            if (at < 0) return;
            contacts[at].SpeedMps = speedMps;
            contacts[at].ForceN = forceN;
        }

        public void End(object key, HapticConnection to)
        {
            int at = Find(key);
            if (at < 0) return;
            bool wasTarget = at == count - 1;
            Array.Copy(contacts, at + 1, contacts, at, count - at - 1);
            contacts[--count] = default(Contact);
            if (count == 0) Release(to);
            else if (wasTarget) Send(Phase.Slide, to);
        }

        /// <summary>Ends all contacts, as when the hand vanishes.</summary>
        public void EndAll(HapticConnection to)
        {
            bool wasActive = count > 0 || nearId != null;
            Array.Clear(contacts, 0, count);
            count = 0;
            nearId = null;
            if (wasActive) Release(to);
        }

        /// <summary>Says which object the hand is about to touch; null when none is near.</summary>
        public void Near(string objectId, HapticConnection to)
        {
            if (count > 0 || objectId == nearId) return;
            nearId = objectId;
            if (objectId == null) Release(to);
            else dueAt = 0.0;
        }

        /// <summary>Renews the lease when it is time. Call once a frame.</summary>
        public void Tick(double now, HapticConnection to)
        {
            if (to == null || to.State != LinkState.Ready) return;
            bool isNewLink = openings != to.Openings;
            openings = to.Openings;
            if (count > 0 && isNewLink) Send(Phase.Contact, to);
            else if (count > 0 && now >= dueAt) Send(Phase.Slide, to);
            else if (nearId != null && now >= dueAt) Send(Phase.Approach, to);
        }

        void Release(HapticConnection to)
        {
            Send(Phase.Release, to);
        }

        void Send(Phase phase, HapticConnection to)
        {
            if (to == null) return;
            Contact contact = count > 0 ? contacts[count - 1] : default(Contact);
            var touch = new Touch
            {
                Phase = phase,
                Hand = hand,
                ObjectId = phase == Phase.Release ? null : contact.ObjectId ?? nearId,
                SpeedMps = Within(contact.SpeedMps, Touch.SpeedMpsMax),
                ForceN = Within(contact.ForceN, Touch.ForceNMax),
                CapturedAt = Clock.Now,
            };
            dueAt = touch.CapturedAt + periodS;
            to.Send(ref touch);
        }

        int Find(object key)
        {
            for (int i = 0; i < count; i++)
            {
                if (ReferenceEquals(contacts[i].Key, key)) return i;
            }
            return -1;
        }

        static double Within(double value, double most)
        {
            return value > 0.0 ? Math.Min(value, most) : 0.0; // NaN is no speed
        }
    }
}
