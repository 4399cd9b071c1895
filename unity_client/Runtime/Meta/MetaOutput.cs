using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Plays amplitude and frequency through Meta's parametric haptics. Touch Pro, Touch Plus and later
    /// controllers support it; older ones ignore the frequency. Add it beside a Controller Haptics. Meta
    /// calls this interface experimental and its Store accepts no app that uses it, so use it for
    /// demonstrations and studies only. Without this component the controller's own impulses are played,
    /// which the Store accepts.
    /// </summary>
    /// <remarks>
    /// Vibration generated during playback is streamed: a First frame of at least the duration that the
    /// controller requires, then Intermediate frames at the interval it requests, with all times counted
    /// from the start of the stream. Little is sent ahead, so that a stop acts quickly: it replaces the
    /// stream by a vibration of amplitude 0.
    /// </remarks>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through Meta XR Core SDK")]
    public sealed class MetaOutput : MonoBehaviour, IHapticPlanOutput
    {
        const double StepS = 0.005; // of the plans that carry a frequency
        const double LateFrameS = 0.02; // sent ahead of the interval, so that a late frame leaves no gap
        const double LongestS = 0.1; // a plan lasts no longer
        const int LowestHz = 1, HighestHz = 1000;

        // Numbers from OpenXR's XR_EXT_haptic_parametric, because Meta's documentation does not give the names.
        const OVRInput.HapticsParametricStreamFrameType NoStream = (OVRInput.HapticsParametricStreamFrameType)0;
        const OVRInput.HapticsParametricStreamFrameType FirstFrame = (OVRInput.HapticsParametricStreamFrameType)1;
        const OVRInput.HapticsParametricStreamFrameType IntermediateFrame = (OVRInput.HapticsParametricStreamFrameType)2;

        static readonly OVRInput.HapticsParametricTransient[] NoTransients = new OVRInput.HapticsParametricTransient[0];

        // Indexed by length, because the interface plays whole arrays; each is allocated once.
        readonly OVRInput.HapticsParametricPoint[][] amplitudes = new OVRInput.HapticsParametricPoint[32][];
        readonly OVRInput.HapticsParametricPoint[][] frequencies = new OVRInput.HapticsParametricPoint[32][];
        double beganAt, sentAt, sentUntil, intervalS;
        bool isStreaming;

        public bool PlaysFrequency { get { return true; } }

        public void Play(HandSide hand, VibrationPlan plan, double now, float gain, float threshold)
        {
            if (isStreaming && now >= sentUntil) isStreaming = false; // the stream ran out: a new one begins
            if (isStreaming && now < sentAt + intervalS) return;
            bool isFirst = !isStreaming;
            double leastS = isFirst ? Begin(hand, now) : 0.0;
            double until = System.Math.Min(now + System.Math.Max(leastS, intervalS + LateFrameS), now + LongestS);
            int count = Mathf.Min(amplitudes.Length - 1, (int)((until - sentUntil) / StepS));
            if (count < (isFirst ? 2 : 1)) return;
            Fill(Points(amplitudes, count), Points(frequencies, count), plan, gain, threshold);
            sentAt = now;
            sentUntil += count * StepS;
            isStreaming = true;
            OVRInput.HapticsParametricStreamFrameType type = isFirst ? FirstFrame : IntermediateFrame;
            Send(hand, amplitudes[count], frequencies[count], type);
        }

        /// <summary>Plays one amplitude for some seconds; Controller Haptics passes the whole plan instead.</summary>
        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            isStreaming = false;
            OVRInput.HapticsParametricPoint[] levels = Points(amplitudes, 2), tones = Points(frequencies, 2);
            for (int i = 0; i < 2; i++)
            {
                levels[i] = new OVRInput.HapticsParametricPoint { Time = i * Nanoseconds(seconds), Value = amplitude };
                tones[i] = new OVRInput.HapticsParametricPoint { Time = i * Nanoseconds(seconds), Value = Tone(frequencyHz) };
            }
            Send(hand, levels, tones, NoStream);
        }

        public void Stop(HandSide hand)
        {
            Play(hand, 0f, LowestHz, (float)StepS);
        }

        /// <summary>Begins a stream; returns the minimum duration of its first frame, s.</summary>
        double Begin(HandSide hand, double now)
        {
            OVRInput.HapticsParametricProperties required = OVRInput.GetControllerParametricProperties(Of(hand));
            beganAt = now;
            sentUntil = now;
            intervalS = System.Math.Min(1e-9 * required.IdealFrameSubmissionRate, LongestS); // 0: no required interval
            return 1e-9 * required.MinimumFirstFrameDuration + StepS; // the last point starts the last step
        }

        void Fill(OVRInput.HapticsParametricPoint[] levels, OVRInput.HapticsParametricPoint[] tones, VibrationPlan plan, float gain, float threshold)
        {
            for (int i = 0; i < levels.Length; i++)
            {
                double at = sentUntil + i * StepS, hz;
                float level = (float)VibrationPlan.Played(plan.Sample(at, out hz), gain, threshold);
                levels[i] = new OVRInput.HapticsParametricPoint { Time = Nanoseconds(at - beganAt), Value = level };
                tones[i] = new OVRInput.HapticsParametricPoint { Time = Nanoseconds(at - beganAt), Value = Tone((float)hz) };
            }
        }

        static void Send(HandSide hand, OVRInput.HapticsParametricPoint[] levels, OVRInput.HapticsParametricPoint[] tones, OVRInput.HapticsParametricStreamFrameType type)
        {
            var vibration = new OVRInput.HapticsParametricVibration();
            vibration.AmplitudePoints = levels;
            vibration.FrequencyPoints = tones;
            vibration.Transients = NoTransients; // the plan's amplitudes include them
            vibration.MinFrequencyHz = LowestHz;
            vibration.MaxFrequencyHz = HighestHz;
            vibration.StreamFrameType = type;
            OVRInput.SetControllerHapticsParametric(vibration, Of(hand));
        }

        static OVRInput.HapticsParametricPoint[] Points(OVRInput.HapticsParametricPoint[][] cache, int count)
        {
            return cache[count] ?? (cache[count] = new OVRInput.HapticsParametricPoint[count]);
        }

        static long Nanoseconds(double seconds)
        {
            return (long)(seconds * 1e9);
        }

        static float Tone(float hz)
        {
            return Mathf.Min(1f, Mathf.Max(0f, hz - LowestHz) / (HighestHz - LowestHz));
        }

        static OVRInput.Controller Of(HandSide hand)
        {
            return hand == HandSide.Left ? OVRInput.Controller.LTouch : OVRInput.Controller.RTouch;
        }
    }
}
