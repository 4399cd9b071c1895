// A controller in the right hand plays what a service sends; says when it begins and ends.
using System.Globalization;
using System.Threading;
using HapticVLM;
using UnityEngine;
using UnityEngine.XR;
using Object = UnityEngine.Object;

public static class Hands
{
    const double Seconds = 6.0;

    public static void Run(string url)
    {
        HapticClient client = Components.Client(url);
        var holder = new GameObject("controller");
        holder.SetActive(false);
        var haptics = holder.AddComponent<ControllerHaptics>();
        Components.Private(haptics, "gain", 0.5f);
        holder.SetActive(true);
        bool was = false;
        float most = 0f;
        for (double until = Clock.Now + Seconds; Clock.Now < until; Thread.Sleep(2))
        {
            Player.Tick(1f / 72f);
            most = System.Math.Max(most, haptics.Amplitude);
            bool isNow = Controllers.Vibrates(XRNode.RightHand);
            if (isNow != was) Components.Say((isNow ? "on " : "off ") + Clock.Now.ToString("f4", CultureInfo.InvariantCulture));
            was = isNow;
        }
        Components.Say("most " + most.ToString("f3") + " left " + Controllers.Pulses.Exists(pulse => pulse.Node == XRNode.LeftHand) + " pulses " + Controllers.Pulses.Count);
        Object.Destroy(holder);
        Object.Destroy(client.gameObject);
        Components.EndOfThreads();
    }
}
