using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Turns the collisions of one hand into touch messages: contact at the first collision, slide to
    /// renew the lease or to change the target, release after the last, and approach before the first.
    /// Sends the current contact again after a reconnect and when this scene gains the outputs. All
    /// fingers of a hand count as one touch.
    /// </summary>
    public sealed class HandTouches
    {
        public delegate void TouchHandler(ref Touch touch);

        /// <summary>A contact slower than this is a press, m/s; our choice.</summary>
        public const double PressBelowMps = 0.1;

        /// <summary>A contact at least this fast is a strike; between the two limits it is a tap, m/s; our choice.</summary>
        public const double StrikeFromMps = 0.7;

        struct Nearest
        {
            public string ObjectId;
            public double DistanceM;
            public double ClosingMps;
            public int? Surface;
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

        /// <summary>Raised with every touch of the hand, also while there is no link, after it was sent.</summary>
        public event TouchHandler Touched;

        public bool IsTouching { get { return contacts.Count > 0; } }

        /// <summary>Id of the object touched last; null when the hand touches nothing.</summary>
        public string ObjectId { get { return contacts.ObjectId; } }

        /// <summary>Id of the object the hand is about to touch; null when none is near.</summary>
        public string NearId { get { return near.ObjectId; } }

        public int Count { get { return contacts.Count; } }

        /// <summary>
        /// The gesture of the hand as set by a script, carving for example; null chooses one by the speed
        /// of contact. A swinging hand feels the air without touching anything.
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

        /// <summary>Id of the object of a contact.</summary>
        public string MetId(int index)
        {
            return contacts.MetId(index);
        }

        /// <summary>
        /// Begins a contact. `surface` is the index of the touched surface in the object's list; null is the largest.
        /// </summary>
        public void Begin(object finger, object met, string objectId, double speedMps, double forceN, HapticConnection to, int? surface = null)
        {
            bool isFirst = !IsTouching;
            string target = ObjectId;
            if (!contacts.Add(finger, met, objectId, speedMps, forceN, surface)) return;
            near = default(Nearest);
            if (isFirst) Send(Phase.Contact, gesture ?? BySpeed(speedMps), to);
            else if (target != objectId) Send(Phase.Slide, gesture ?? Interaction.Slide, to);
        }

        /// <summary>Updates speed, force and surface of a contact; the next renewal sends them.</summary>
        public void Follow(object finger, object met, double speedMps, double forceN, int? surface = null)
        {
            contacts.Follow(finger, met, speedMps, forceN, surface);
        }

        /// <summary>
        /// Updates the speed of a hand that touches nothing and the object it swings, null for none.
        /// Both determine how a swing feels.
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

        /// <summary>Ends the contacts of one finger, for example when it disappears.</summary>
        public void EndFinger(object finger, HapticConnection to)
        {
            for (int i = Count - 1; i >= 0; i--)
            {
                if (ReferenceEquals(contacts.Finger(i), finger)) End(finger, contacts.Met(i), to);
            }
        }

        /// <summary>Ends all contacts, for example when the hand disappears.</summary>
        public void EndAll(HapticConnection to)
        {
            bool wasActive = IsTouching || near.ObjectId != null;
            contacts.Clear();
            near = default(Nearest);
            if (wasActive) Release(to);
        }

        /// <summary>
        /// Updates the object the hand is about to touch, its distance, the closing speed and the surface; a null id
        /// when none is near.
        /// </summary>
        public void Near(string objectId, double distanceM, double closingMps, HapticConnection to, int? surface = null)
        {
            if (IsTouching) return;
            bool isNew = objectId != near.ObjectId;
            near = new Nearest { ObjectId = objectId, DistanceM = distanceM, ClosingMps = closingMps, Surface = surface };
            if (isNew && objectId == null) Release(to);
            else if (isNew) dueAt = 0.0;
        }

        /// <summary>
        /// Plays an effect as a contact of its own. It suspends the current contact, which resumes
        /// afterwards. The current contact is released first, so that an impact is felt.
        /// </summary>
        public void Play(HandEffect next, HapticConnection to)
        {
            if (IsTouching || effect.IsOn) Release(to);
            effect = next;
            SendEffect(Clock.Now, to);
        }

        /// <summary>Whether an effect is being played.</summary>
        public bool IsPlaying { get { return effect.IsOn; } }

        /// <summary>Renews the lease when it is due. Call it once per frame.</summary>
        public void Tick(double now, HapticConnection to)
        {
            if (to != null && to.State != LinkState.Ready) to = null; // a renewal that no service receives counts nowhere
            if (to == null && Touched == null)
            {
                effect = default(HandEffect);
                return;
            }
            if (IsPlaying && ContinueEffect(now, to)) return;
            bool isNew = to != null && epoch != to.Outbox.Ownership.Epoch;
            if (to != null) epoch = to.Outbox.Ownership.Epoch;
            if (IsTouching && isNew) Send(Phase.Contact, gesture ?? BySpeed(contacts.NewestSpeedMps), to, false);
            else if (isNew) Send(Phase.Release, null, to, false); // a stop lasts until the hand releases, also across sessions
            else if (now < dueAt) return;
            else if (IsTouching) Send(Phase.Slide, gesture ?? Interaction.Slide, to);
            else if (gesture == Interaction.Swing || near.ObjectId != null) Send(Phase.Approach, ApproachGesture, to);
        }

        /// <summary>The gesture of a hand in the air: a swing or none.</summary>
        Interaction? ApproachGesture { get { return gesture == Interaction.Swing ? gesture : null; } }

        static Interaction BySpeed(double speedMps)
        {
            if (speedMps >= StrikeFromMps) return Interaction.Strike;
            return speedMps < PressBelowMps ? Interaction.Press : Interaction.Tap;
        }

        /// <summary>Renews or ends the effect; returns false if it ended and the hand still touches something.</summary>
        bool ContinueEffect(double now, HapticConnection to)
        {
            if (now < effect.Until)
            {
                if (now >= dueAt) SendEffect(now, to);
                return true;
            }
            effect = default(HandEffect);
            dueAt = 0.0; // the suspended contact is sent at once, as a slide because it began earlier
            if (IsTouching) return false;
            Release(to);
            return true;
        }

        void SendEffect(double now, HapticConnection to)
        {
            Touch touch = effect.Touch(hand, now);
            dueAt = now + periodS;
            Deliver(ref touch, to);
        }

        void Release(HapticConnection to)
        {
            Send(Phase.Release, null, to);
        }

        /// <summary>Sends a touch; one that only tells a new session of an old contact is not new to others.</summary>
        void Send(Phase phase, Interaction? interaction, HapticConnection to, bool isRaised = true)
        {
            if ((to == null && Touched == null) || (IsPlaying && phase != Phase.Release)) return;
            var touch = new Touch { Phase = phase, Hand = hand, Interaction = interaction, CapturedAt = Clock.Now };
            if (IsTouching) contacts.Fill(ref touch);
            else if (phase == Phase.Approach) FillApproach(ref touch);
            dueAt = touch.CapturedAt + periodS;
            if (isRaised) Deliver(ref touch, to);
            else to.Send(ref touch);
        }

        void Deliver(ref Touch touch, HapticConnection to)
        {
            if (to != null) to.Send(ref touch);
            if (Touched != null) Touched(ref touch);
        }

        void FillApproach(ref Touch touch)
        {
            bool swings = touch.Interaction == Interaction.Swing;
            touch.ObjectId = swings ? swungId ?? near.ObjectId : near.ObjectId;
            if (swings) touch.SpeedMps = HandContacts.Within(freeSpeedMps, Touch.SpeedMpsMax);
            if (swings || near.ObjectId == null) return;
            touch.Surface = near.Surface;
            touch.DistanceM = HandContacts.Within(near.DistanceM, Touch.DistanceMMax);
            touch.ClosingMps = near.ClosingMps < 0.0 ? -HandContacts.Within(-near.ClosingMps, Touch.ClosingMpsMax) : HandContacts.Within(near.ClosingMps, Touch.ClosingMpsMax);
        }
    }
}
