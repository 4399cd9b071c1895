using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Amplitude and frequency through Meta's parametric haptics, which Touch Pro, Touch Plus and later
    /// controllers play; older ones ignore the frequency. Put it beside a Controller Haptics.
    /// </summary>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through Meta XR Core SDK")]
    public sealed class MetaOutput : MonoBehaviour, IHapticOutput
    {
        // Played once a frame: the next replaces it, and without one it ends by itself. Constants,
        // so that they fit whichever integer type a release of the SDK has.
        const int PulseNs = 30000000;
        const int LowestHz = 1, HighestHz = 1000;

        static readonly OVRInput.HapticsParametricTransient[] NoTransients = new OVRInput.HapticsParametricTransient[0];

        readonly OVRInput.HapticsParametricPoint[] amplitudes = new OVRInput.HapticsParametricPoint[2];
        readonly OVRInput.HapticsParametricPoint[] frequencies = new OVRInput.HapticsParametricPoint[2];

        public bool PlaysFrequency { get { return true; } }

        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            float share = Mathf.Min(1f, Mathf.Max(0f, frequencyHz - LowestHz) / (HighestHz - LowestHz));
            for (int i = 0; i < 2; i++)
            {
                amplitudes[i].Value = amplitude;
                frequencies[i].Value = share;
            }
            var vibration = new OVRInput.HapticsParametricVibration();
            vibration.AmplitudePoints = amplitudes;
            vibration.FrequencyPoints = frequencies;
            vibration.Transients = NoTransients;
            vibration.MinFrequencyHz = LowestHz;
            vibration.MaxFrequencyHz = HighestHz;
            vibration.StreamFrameType = OVRInput.HapticsParametricStreamFrameType.None;
            OVRInput.SetControllerHapticsParametric(vibration, Of(hand));
        }

        public void Stop(HandSide hand)
        {
            Play(hand, 0f, LowestHz, 0f);
        }

        void Awake()
        {
            amplitudes[1].Time = PulseNs;
            frequencies[1].Time = PulseNs;
        }

        static OVRInput.Controller Of(HandSide hand)
        {
            return hand == HandSide.Left ? OVRInput.Controller.LTouch : OVRInput.Controller.RTouch;
        }
    }
}
