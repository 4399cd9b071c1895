using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>What a script plays on one hand for a while: a contact that no collider makes.</summary>
    public struct HandEffect
    {
        public string ObjectId;
        public Interaction Interaction;
        public double SpeedMps;
        public double ForceN;
        public double Until;

        public bool IsOn { get { return ObjectId != null; } }

        /// <summary>A contact that begins or renews it; with its interaction named it makes no second blow.</summary>
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
