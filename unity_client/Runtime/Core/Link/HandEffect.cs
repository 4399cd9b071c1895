using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>An effect that a script plays on one hand for a while: a contact without a collider.</summary>
    public struct HandEffect
    {
        public string ObjectId;
        public Interaction Interaction;
        public double SpeedMps;
        public double ForceN;
        public double Until;

        public bool IsOn { get { return ObjectId != null; } }

        /// <summary>The contact message that starts or renews it. As it names its interaction, a renewal is not felt as a second impact.</summary>
        public Touch Touch(HandName hand, double now)
        {
            return new Touch
            {
                Phase = Phase.Contact,
                Hand = hand,
                ObjectId = ObjectId,
                Interaction = Interaction,
                SpeedMps = Math.Min(Math.Max(0.0, SpeedMps), Wire.Touch.SpeedMpsMax),
                ForceN = Math.Min(Math.Max(0.0, ForceN), Wire.Touch.ForceNMax),
                CapturedAt = now,
            };
        }
    }
}
