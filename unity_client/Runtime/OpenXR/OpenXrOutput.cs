using UnityEngine;
using UnityEngine.InputSystem;
using UnityEngine.XR.OpenXR;
using UnityEngine.XR.OpenXR.Input;

namespace HapticVLM
{
    /// <summary>
    /// Plays through OpenXR: samples where the feature "HapticVLM: samples on controllers" is enabled and the controller
    /// takes them, as on Quest, else impulses with a frequency. Add it beside a Controller Haptics. Runtimes may ignore
    /// the frequency; Quest's does.
    /// </summary>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through OpenXR")]
    public sealed class OpenXrOutput : MonoBehaviour, IHapticWaveOutput
    {
        const float RateHoldsS = 1f; // a controller may be taken up, or replaced, meanwhile

        readonly int[] rates = new int[2]; // Hz, of the left and the right hand
        readonly float[] askedAt = { float.NegativeInfinity, float.NegativeInfinity };
        InputAction left, right;
        HapticPcmFeature pcm;

        public bool PlaysFrequency { get { return true; } }

        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            OpenXRInput.SendHapticImpulse(Of(hand), amplitude, frequencyHz, seconds);
        }

        public int RateHz(HandSide hand)
        {
            int side = hand == HandSide.Left ? 0 : 1;
            if (pcm == null || Time.unscaledTime - askedAt[side] < RateHoldsS) return rates[side];
            askedAt[side] = Time.unscaledTime;
            return rates[side] = pcm.RateHz(OpenXRInput.GetActionHandle(Of(hand)), hand);
        }

        public int Play(HandSide hand, float[] wave, int count, bool replaces)
        {
            return pcm.Play(OpenXRInput.GetActionHandle(Of(hand)), hand, wave, count, rates[hand == HandSide.Left ? 0 : 1], replaces);
        }

        public void Stop(HandSide hand)
        {
            if (pcm != null) pcm.Stop(OpenXRInput.GetActionHandle(Of(hand)), hand);
            else OpenXRInput.StopHaptics(Of(hand));
        }

        void Awake()
        {
            left = Action("LeftHand");
            right = Action("RightHand");
            HapticPcmFeature feature = OpenXRSettings.Instance == null ? null : OpenXRSettings.Instance.GetFeature<HapticPcmFeature>();
            if (feature != null && feature.enabled) pcm = feature;
        }

        void OnDestroy()
        {
            left.Dispose();
            right.Dispose();
        }

        InputAction Of(HandSide hand)
        {
            return hand == HandSide.Left ? left : right;
        }

        static InputAction Action(string hand)
        {
            var action = new InputAction("HapticVLM " + hand, InputActionType.PassThrough, "<XRController>{" + hand + "}/{Haptic}");
            action.Enable();
            return action;
        }
    }
}
