using UnityEngine;
using UnityEngine.InputSystem;
using UnityEngine.XR.OpenXR.Input;

namespace HapticVLM
{
    /// <summary>
    /// Plays impulses with a frequency through OpenXR. Add it beside a Controller Haptics. Runtimes may
    /// ignore the frequency; Quest's runtime does.
    /// </summary>
    [RequireComponent(typeof(ControllerHaptics)), AddComponentMenu("HapticVLM/Output through OpenXR")]
    public sealed class OpenXrOutput : MonoBehaviour, IHapticOutput
    {
        InputAction left, right;

        public bool PlaysFrequency { get { return true; } }

        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            OpenXRInput.SendHapticImpulse(Of(hand), amplitude, frequencyHz, seconds);
        }

        public void Stop(HandSide hand)
        {
            OpenXRInput.StopHaptics(Of(hand));
        }

        void Awake()
        {
            left = Action("LeftHand");
            right = Action("RightHand");
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
