using UnityEngine.XR;

namespace HapticVLM
{
    /// <summary>Plays the controller's own impulses, which every XR plug-in supports; amplitude only.</summary>
    internal sealed class XrDeviceOutput : IHapticOutput
    {
        const uint Channel = 0;

        public bool PlaysFrequency { get { return false; } }

        public void Play(HandSide hand, float amplitude, float frequencyHz, float seconds)
        {
            Device(hand).SendHapticImpulse(Channel, amplitude, seconds);
        }

        public void Stop(HandSide hand)
        {
            Device(hand).StopHaptics();
        }

        static InputDevice Device(HandSide hand)
        {
            return InputDevices.GetDeviceAtXRNode(hand == HandSide.Left ? XRNode.LeftHand : XRNode.RightHand);
        }
    }
}
