using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>All Haptic Hands of one side, which produce one touch together.</summary>
    internal sealed class HandGroup
    {
        const double RenewalsPerS = 40.0; // a lease lasts 250 ms; a bake takes over 60 ms after the first unanswered touch

        static readonly HandGroup Left = new HandGroup(HandName.Left), Right = new HandGroup(HandName.Right);

        public readonly HandTouches Touches;
        readonly List<HapticHand> fingers = new List<HapticHand>();

        HandGroup(HandName hand)
        {
            Touches = new HandTouches(hand, RenewalsPerS);
        }

        public static HandGroup Of(HandSide side)
        {
            return side == HandSide.Left ? Left : Right;
        }

        public void Join(HapticHand finger)
        {
            if (!fingers.Contains(finger)) fingers.Add(finger);
        }

        public void Leave(HapticHand finger, HapticConnection to)
        {
            fingers.Remove(finger);
            Touches.EndFinger(finger, to);
            if (fingers.Count == 0) Touches.EndAll(to);
        }

        /// <summary>Sets the gesture of the hand to that of the first finger that has one.</summary>
        public void UpdateGesture()
        {
            var gesture = HandGesture.BySpeed;
            for (int i = 0; i < fingers.Count && gesture == HandGesture.BySpeed; i++) gesture = fingers[i].Gesture;
            Touches.Gesture = HandGestures.OnWire(gesture);
        }

        /// <summary>Combines all fingers once per frame, when called by the first of them.</summary>
        public void Tick(HapticHand finger, HapticConnection to)
        {
            if (!ReferenceEquals(fingers[0], finger)) return;
            double speed = 0.0;
            HapticHand nearest = null;
            HapticObject swung = null;
            for (int i = 0; i < fingers.Count; i++)
            {
                if (fingers[i].Near != null && (nearest == null || fingers[i].NearM < nearest.NearM)) nearest = fingers[i];
                if (fingers[i].Swung != null) swung = fingers[i].Swung;
                if (fingers[i].FreeSpeedMps > speed) speed = fingers[i].FreeSpeedMps;
            }
            UpdateGesture();
            Touches.Move(speed, swung == null ? null : swung.ObjectId);
            if (nearest == null) Touches.Near(null, 0.0, 0.0, to);
            else Touches.Near(nearest.Near.ObjectId, nearest.NearM, nearest.ClosingMps, to, nearest.NearSurface);
            Touches.Tick(Clock.Now, to);
        }

        /// <summary>Continues effects of scripts on sides that have no Haptic Hand.</summary>
        public static void TickThoseWithoutFingers(HapticConnection to)
        {
            if (Left.fingers.Count == 0 && Left.Touches.IsPlaying) Left.Touches.Tick(Clock.Now, to);
            if (Right.fingers.Count == 0 && Right.Touches.IsPlaying) Right.Touches.Tick(Clock.Now, to);
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            foreach (HandGroup group in new[] { Left, Right })
            {
                group.fingers.Clear();
                group.Touches.EndAll(null);
                group.Touches.Gesture = null;
            }
        }
    }
}
