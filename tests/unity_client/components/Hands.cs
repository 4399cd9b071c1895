// A controller in the right hand plays vibration from a service; prints the start and end of each pulse.
using System;
using System.Globalization;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.XR;
using Object = UnityEngine.Object;

public static class Hands
{
    const double Seconds = 5.5;

    static void Run(string url, bool silentWithSpeaker)
    {
        HapticClient client = Components.Client(url);
        var haptics = Components.Made<ControllerHaptics>("controller", controller =>
        {
            Components.Private(controller, "gain", 0.5f);
            Components.Private(controller, "silentWithSpeaker", silentWithSpeaker);
        });
        Components.Run(() => client.State == LinkState.Ready, "no welcome"); // after it the script begins
        string silence = null;
        bool was = false;
        float most = 0f;
        for (double until = Clock.Now + Seconds; Clock.Now < until; Thread.Sleep(2))
        {
            Player.Tick(1f / 72f);
            most = System.Math.Max(most, haptics.Amplitude);
            if (client.State == LinkState.Ready && client.FeltBy == FeltMode.Service) silence = haptics.Silence ?? silence;
            bool isNow = Controllers.Vibrates(XRNode.RightHand);
            if (isNow != was) Components.Say((isNow ? "on " : "off ") + Clock.Now.ToString("f4", CultureInfo.InvariantCulture));
            was = isNow;
        }
        Components.Say("most " + most.ToString("f3") + " left " + Controllers.Pulses.Exists(pulse => pulse.Node == XRNode.LeftHand) + " pulses " + Controllers.Pulses.Count);
        Components.Say("silent because " + silence);
        Object.Destroy(haptics.gameObject);
        Object.Destroy(client.gameObject);
    }

    // Says how many plans, and how many stops, are passed on with a link and without.
    static void Early(string isConnected)
    {
        var link = new FeltLink { IsConnected = bool.Parse(isConnected), IsOwner = bool.Parse(isConnected) };
        var felt = new Felt(() => link, hand => FeelForm.Amplitude);
        int plans = 0, stops = 0;
        felt.Vibrated += vibration => { if (vibration.Stopped == true) stops++; else plans++; };
        felt.Serve(new Vibration { Hand = HandName.Right, PeriodMs = 14.0, Amplitude = { 0.8 } });
        felt.Serve(new Vibration { Hand = HandName.Right, PeriodMs = 14.0, Stopped = true });
        Components.Say("plans " + plans + " stops " + stops);
    }
}
