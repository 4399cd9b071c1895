using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Turns what the colliders of one hand meet into touches: contact at the first, slide to renew
    /// the lease and to change target, release after the last; approach before. After a reconnect it
    /// sends again what the hand touches, and so it does when the outputs become this scene's. All
    /// fingers of a hand are one touch.
    /// </summary>
    public sealed class HandTouches
    {
        /// <summary>A slower contact is a press, m/s; our choice.</summary>
        public const double PressBelowMps = 0.1;

        /// <summary>A faster contact is a strike, in between is a tap, m/s; our choice.</summary>
        public const double StrikeFromMps = 0.7;

        struct Nearest
        {
            public string ObjectId;
            public double DistanceM;
            public double ClosingMps;
        }

        readonly HandName hand;
        readonly double periodS;
        readonly HandContacts contacts = new HandContacts();
        Nearest near;
        HandEffect effect;
        Interaction? gesture;
        string swungId;
        double freeSpeedMps;
        double dueAt;
        int epoch;

        public HandTouches(HandName hand, double renewalsPerS)
        {
            if (hand == HandName.Other) throw new ArgumentException("a hand is left or right", "hand");
            this.hand = hand;
            periodS = 1.0 / renewalsPerS;
        }

        public bool IsTouching { get { return contacts.Count > 0; } }

        /// <summary>What is touched: the object met last; null when none is.</summary>
        public string ObjectId { get { return contacts.ObjectId; } }

        /// <summary>The object the hand is about to touch; null when none is near.</summary>
        public string NearId { get { return near.ObjectId; } }

        public int Count { get { return contacts.Count; } }

        /// <summary>
        /// How the hand acts, where a script knows it: carving, say. Null: by the speed of contact.
        /// While it swings, the air is felt without a touch.
        /// </summary>
        public Interaction? Gesture
        {
            get { return gesture; }
            set { gesture = value == Interaction.Other ? null : value; }
        }

        public object Finger(int index)
        {
            return contacts.Finger(index);
        }

        public object Met(int index)
        {
            return contacts.Met(index);
        }

        public void Begin(object finger, object met, string objectId, double speedMps, double forceN, HapticConnection to)
        {
            bool isFirst = !IsTouching;
            string target = ObjectId;
            if (!contacts.Add(finger, met, objectId, speedMps, forceN)) return;
            near = default(Nearest);
            if (isFirst) Send(Phase.Contact, gesture ?? ByContact(speedMps), to);
            else if (target != objectId) Send(Phase.Slide, gesture ?? Interaction.Slide, to);
        }

        /// <summary>Follows a finger's contact; it goes out with the next renewal.</summary>
        public void Follow(object finger, object met, double speedMps, double forceN)
        {
            contacts.Follow(finger, met, speedMps, forceN);
        }

        /// <summary>
        /// Follows how fast a hand moves that touches nothing, and what it swings: a swing is felt by
        /// both; null when it holds nothing that is known.
        /// </summary>
        public void Move(double speedMps, string swungObjectId)
        {
            freeSpeedMps = speedMps;
            swungId = swungObjectId;
        }

        public void End(object finger, object met, HapticConnection to)
        {
            string target = ObjectId;
            if (!contacts.Remove(finger, met)) return;
            if (!IsTouching) Release(to);
            else if (ObjectId != target) Send(Phase.Slide, gesture ?? Interaction.Slide, to);
        }

        /// <summary>Ends the contacts of a finger, as when it vanishes.</summary>
        public void EndFinger(object finger, HapticConnection to)
        {
            for (int i = Count - 1; i >= 0; i--)
            {
                if (ReferenceEquals(contacts.Finger(i), finger)) End(finger, contacts.Met(i), to);
            }
        }

        /// <summary>Ends all contacts, as when the hand vanishes.</summary>
        public void EndAll(HapticConnection to)
        {
            bool wasActive = IsTouching || near.ObjectId != null;
            contacts.Clear();
            near = default(Nearest);
            if (wasActive) Release(to);
        }

        /// <summary>
        /// Notes the object the hand is about to touch, how far it is and how fast the hand comes
        /// nearer; a null id when none is near.
        /// </summary>
        public void Near(string objectId, double distanceM, double closingMps, HapticConnection to)
        {
            if (IsTouching) return;
            bool isNew = objectId != near.ObjectId;
            near = new Nearest { ObjectId = objectId, DistanceM = distanceM, ClosingMps = closingMps };
            if (isNew && objectId == null) Release(to);
            else if (isNew) dueAt = 0.0;
        }

        /// <summary>
        /// Plays an effect: as a contact of its own, before what the hand touches, which goes on after it.
        /// A hand that touches is let go first, so that a blow is felt.
        /// </summary>
        public void Play(HandEffect next, HapticConnection to)
        {
            if (IsTouching || effect.IsOn) Release(to);
            effect = next;
            SendEffect(Clock.Now, to);
        }

        /// <summary>Whether an effect is played now.</summary>
        public bool IsPlaying { get { return effect.IsOn; } }

        /// <summary>Renews the lease when it is time. Call once a frame.</summary>
        public void Tick(double now, HapticConnection to)
        {
            if (to == null || to.State != LinkState.Ready)
            {
                effect = default(HandEffect);
                return;
            }
            if (IsPlaying && GoOn(now, to)) return;
            bool isNew = epoch != to.Outbox.Ownership.Epoch;
            epoch = to.Outbox.Ownership.Epoch;
            if (IsTouching && isNew) Send(Phase.Contact, gesture ?? ByContact(contacts.NewestSpeedMps), to);
            else if (isNew) Release(to); // a stop holds until a hand lets go, whatever session it was in
            else if (now < dueAt) return;
            else if (IsTouching) Send(Phase.Slide, gesture ?? Interaction.Slide, to);
            else if (gesture == Interaction.Swing || near.ObjectId != null) Send(Phase.Approach, Approaching, to);
        }

        /// <summary>A hand in the air can only swing.</summary>
        Interaction? Approaching { get { return gesture == Interaction.Swing ? gesture : null; } }

        static Interaction ByContact(double speedMps)
        {
            if (speedMps >= StrikeFromMps) return Interaction.Strike;
            return speedMps < PressBelowMps ? Interaction.Press : Interaction.Tap;
        }

        /// <summary>Renews the effect, or ends it; then false, unless the hand is let go with it.</summary>
        bool GoOn(double now, HapticConnection to)
        {
            if (now < effect.Until)
            {
                if (now >= dueAt) SendEffect(now, to);
                return true;
            }
            effect = default(HandEffect);
            dueAt = 0.0; // what the hand touches is told at once, as a slide: it was met before
            if (IsTouching) return false;
            Release(to);
            return true;
        }

        void SendEffect(double now, HapticConnection to)
        {
            if (to == null) return;
            Touch touch = effect.Touch(hand, now);
            dueAt = now + periodS;
            to.Send(ref touch);
        }

        void Release(HapticConnection to)
        {
            Send(Phase.Release, null, to);
        }

        void Send(Phase phase, Interaction? interaction, HapticConnection to)
        {
            if (to == null || (IsPlaying && phase != Phase.Release)) return;
            var touch = new Touch { Phase = phase, Hand = hand, Interaction = interaction, CapturedAt = Clock.Now };
            if (IsTouching) contacts.Fill(ref touch);
            else if (phase == Phase.Approach) FillApproach(ref touch);
            dueAt = touch.CapturedAt + periodS;
            to.Send(ref touch);
        }

        void FillApproach(ref Touch touch)
        {
            bool swings = touch.Interaction == Interaction.Swing;
            touch.ObjectId = swings ? swungId ?? near.ObjectId : near.ObjectId;
            if (swings) touch.SpeedMps = HandContacts.Within(freeSpeedMps, Touch.SpeedMpsMax);
            if (swings || near.ObjectId == null) return;
            touch.DistanceM = HandContacts.Within(near.DistanceM, Touch.DistanceMMax);
            touch.ClosingMps = near.ClosingMps < 0.0 ? -HandContacts.Within(-near.ClosingMps, Touch.ClosingMpsMax) : HandContacts.Within(near.ClosingMps, Touch.ClosingMpsMax);
        }
    }
}
