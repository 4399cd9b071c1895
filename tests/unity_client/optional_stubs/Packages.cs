// Stand-ins for members of packages that a project may have: Input System, OpenXR, XRI 3,
// Meta XR Core SDK 85 (from its page on parametric haptics).
using UnityEngine;

namespace UnityEngine.InputSystem
{
    public enum InputActionType { Value, Button, PassThrough }

    public class InputDevice { }

    // Reads the mouse of the simulated user.
    public class Mouse : InputDevice
    {
        public static Mouse current { get { return new Mouse(); } }

        public Controls.ButtonControl leftButton { get { return new Controls.ButtonControl(); } }
        public Controls.Vector2Control position { get { return new Controls.Vector2Control(); } }
    }

    public sealed class InputAction : System.IDisposable
    {
        public InputAction(string name = null, InputActionType type = InputActionType.Value, string binding = null, string interactions = null, string processors = null, string expectedControlType = null) { }

        public void Enable() { }
        public void Dispose() { }
    }
}

namespace UnityEngine.InputSystem.Controls
{
    public class ButtonControl
    {
        public bool isPressed { get { return Input.IsDown; } }
    }

    public class Vector2Control
    {
        public Vector2 ReadValue() { return new Vector2(Input.mousePosition.x, Input.mousePosition.y); }
    }
}

namespace UnityEngine.XR.OpenXR.Input
{
    public static class OpenXRInput
    {
        public static int Impulses, Stops;

        public static void SendHapticImpulse(InputSystem.InputAction action, float amplitude, float frequency, float duration, InputSystem.InputDevice inputDevice = null) { Impulses++; }
        public static void StopHaptics(InputSystem.InputAction inputAction, InputSystem.InputDevice inputDevice = null) { Stops++; }
        public static ulong GetActionHandle(InputSystem.InputAction inputAction, InputSystem.InputDevice inputDevice = null) { return StandInRuntime.Action; }
    }
}

namespace UnityEngine.XR.Interaction.Toolkit.Inputs.Haptics
{
    public class HapticImpulsePlayer : MonoBehaviour
    {
        public bool SendHapticImpulse(float amplitude, float duration) { return true; }
        public bool SendHapticImpulse(float amplitude, float duration, float frequency) { return true; }
    }
}

public static class OVRInput
{
    public enum Controller { None = 0, LTouch = 1, RTouch = 2 }
    public enum HapticsParametricStreamFrameType : uint { None }

    public struct HapticsParametricPoint { public long Time; public float Value; }
    public struct HapticsParametricTransient { public long Time; public float Amplitude; public float Frequency; }

    public struct HapticsParametricVibration
    {
        public HapticsParametricPoint[] AmplitudePoints;
        public HapticsParametricPoint[] FrequencyPoints;
        public HapticsParametricTransient[] Transients;
        public float MinFrequencyHz;
        public float MaxFrequencyHz;
        public HapticsParametricStreamFrameType StreamFrameType;
    }

    public struct HapticsParametricProperties
    {
        public long IdealFrameSubmissionRate;
        public long MinimumFirstFrameDuration;
    }

    // A controller that requires 30 ms in the first frame and then a frame every 20 ms.
    public static HapticsParametricProperties GetControllerParametricProperties(Controller controllerMask)
    {
        return new HapticsParametricProperties { IdealFrameSubmissionRate = 20000000, MinimumFirstFrameDuration = 30000000 };
    }

    public static readonly System.Collections.Generic.List<string> Sent = new System.Collections.Generic.List<string>();

    public static void SetControllerHapticsParametric(HapticsParametricVibration hapticsVibration, Controller controllerMask = Controller.RTouch)
    {
        HapticsParametricPoint[] points = hapticsVibration.AmplitudePoints;
        float most = 0f;
        foreach (HapticsParametricPoint point in points) most = System.Math.Max(most, point.Value);
        Sent.Add(string.Format(System.Globalization.CultureInfo.InvariantCulture, "{0} from {1} to {2} most {3:f2}", (uint)hapticsVibration.StreamFrameType,
            System.Math.Round(1e-6 * points[0].Time), System.Math.Round(1e-6 * points[points.Length - 1].Time), most));
    }
}
