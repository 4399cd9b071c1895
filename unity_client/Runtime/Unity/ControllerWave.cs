using System;
using HapticVLM.Baked;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Renders what the palm would feel of one hand's touches for an output that plays samples. It sends one frame and 10 ms
    /// ahead: a late frame leaves no gap, and what an app that hangs leaves behind ends soon. It takes no memory per frame.
    /// </summary>
    internal sealed class ControllerWave
    {
        const double AheadS = 0.01;
        const int Most = 1000; // samples sent at once; OpenXR takes 4,000

        readonly IHapticWaveOutput output;
        readonly HandSide hand;
        readonly HeardTouches touches;
        readonly float[] wave = new float[Most];
        double sentUntil = double.NegativeInfinity, soundedAt = double.NegativeInfinity;

        public ControllerWave(IHapticWaveOutput output, HandSide hand, Func<HandName, bool> isHeard)
        {
            this.output = output;
            this.hand = hand;
            touches = new HeardTouches(isHeard, hand == HandSide.Left ? HandName.Left : HandName.Right);
        }

        /// <summary>Whether samples were sent within the duration of a plan: its impulses are not played beside them.</summary>
        public bool IsHeard(double now)
        {
            return now - soundedAt < VibrationPlan.HorizonS;
        }

        /// <summary>Sends what is due at `now`, s, multiplied by `gain`. Returns the largest sample that was sent, 0..1.</summary>
        public float Play(Felt felt, double now, double frameS, float gain)
        {
            int rateHz = output.RateHz(hand);
            touches.Follow(felt, HeardVoice.True, rateHz);
            if (touches.IsSilent) return 0f;
            bool replaces = sentUntil < now;
            if (replaces) sentUntil = now;
            int count = (int)Math.Min(Most, Math.Ceiling((now + frameS + AheadS - sentUntil) * rateHz));
            if (count <= 0) return 0f;
            touches.Render(wave, count);
            float largest = 0f;
            for (int at = 0; at < count; at++)
            {
                wave[at] = Math.Min(1f, Math.Max(-1f, gain * wave[at]));
                largest = Math.Max(largest, Math.Abs(wave[at]));
            }
            sentUntil += (double)output.Play(hand, wave, count, replaces) / rateHz;
            soundedAt = now;
            return largest;
        }

        /// <summary>Forgets what sounds. The hand is felt again with its next touch.</summary>
        public void Drop()
        {
            touches.Follow(null, HeardVoice.True, 0);
            sentUntil = soundedAt = double.NegativeInfinity;
        }
    }
}
