using System.Collections.Generic;

namespace UnityEngine.XR
{
    public enum XRNode { LeftHand = 4, RightHand = 5 }

    public struct InputDevice
    {
        internal XRNode Node;

        public bool SendHapticImpulse(uint channel, float amplitude, float duration = 1f)
        {
            Controllers.Pulses.Add(new Controllers.Pulse { Node = Node, Amplitude = amplitude, Seconds = duration, At = Controllers.Now() });
            return true;
        }

        public void StopHaptics()
        {
            Controllers.Pulses.Add(new Controllers.Pulse { Node = Node, At = Controllers.Now() });
        }
    }

    public static class InputDevices
    {
        public static InputDevice GetDeviceAtXRNode(XRNode node) { return new InputDevice { Node = node }; }
    }

    // Records the impulses of the two controllers; a pulse ends by itself, as on a real device.
    public static class Controllers
    {
        public struct Pulse
        {
            public XRNode Node;
            public float Amplitude, Seconds;
            public double At;
        }

        public static readonly List<Pulse> Pulses = new List<Pulse>();

        public static double Now()
        {
            return (double)System.Diagnostics.Stopwatch.GetTimestamp() / System.Diagnostics.Stopwatch.Frequency;
        }

        public static bool Vibrates(XRNode node)
        {
            for (int i = Pulses.Count - 1; i >= 0; i--)
            {
                if (Pulses[i].Node == node) return Pulses[i].Amplitude > 0f && Now() < Pulses[i].At + Pulses[i].Seconds;
            }
            return false;
        }
    }
}
