// A controller in the right hand plays vibration from a service; prints the start and end of each pulse.
using System;
using System.Globalization;
using System.Threading;
using HapticVLM;
using UnityEngine;
using UnityEngine.XR;
using Object = UnityEngine.Object;

public static class Hands
{
    const double Seconds = 5.5;

    public static void Run(string url, bool silentWithSpeaker)
    {
        HapticClient client = Components.Client(url);
        var holder = new GameObject("controller");
        holder.SetActive(false);
        var haptics = holder.AddComponent<ControllerHaptics>();
        Components.Private(haptics, "gain", 0.5f);
        Components.Private(haptics, "silentWithSpeaker", silentWithSpeaker);
        holder.SetActive(true);
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
        Object.Destroy(holder);
        Object.Destroy(client.gameObject);
        Components.EndOfThreads();
    }

    // A hand strokes a wall: measures the controller's vibration before a stop, after it, and after the hand left.
    public static void Feel(string url)
    {
        HapticClient client = Components.Client(url);
        Moves.Box("wall", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f), "wood");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 1f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        for (int i = 0; i < 60 && Stroke(hand, haptics, 0.06f, 0.5) == 0.0;) i++; // the service prepares what was asked for
        Components.Say("stroking " + Text(Stroke(hand, haptics, 0.06f, 1.5)));
        client.Stop();
        Components.Say("stop " + Text(MillisecondsToSilence(hand)));
        Components.Say("held " + Text(Stroke(hand, haptics, 0.06f, 0.5)));
        Stroke(hand, haptics, 1f, 0.5);
        Stroke(hand, haptics, 0.06f, 0.5);
        Components.Say("again " + Text(Stroke(hand, haptics, 0.06f, 1.0)));
        hand.transform.position = new Vector3(0f, 0f, 1f);
        Components.Say("gone " + Text(MillisecondsToSilence(hand)));
        Object.Destroy(client.gameObject);
        Components.EndOfThreads();
    }

    // Returns the share of frames with vibration while the hand moves at 0.3 m/s.
    static double Stroke(HapticHand hand, ControllerHaptics haptics, float z, double seconds)
    {
        int frames = 0, vibrating = 0;
        double from = Clock.Now;
        for (double now = from; now < from + seconds; now = Clock.Now)
        {
            float x = hand.transform.position.x + 0.3f / 72f;
            hand.transform.position = new Vector3(x, 0f, z);
            Player.Tick(1f / 72f);
            frames++;
            if (haptics.Amplitude > 0f && Controllers.Vibrates(XRNode.RightHand)) vibrating++;
            Thread.Sleep(Math.Max(0, (int)(1e3 * (now + 1.0 / 72.0 - Clock.Now))));
        }
        return vibrating / (double)frames;
    }

    static double MillisecondsToSilence(HapticHand hand)
    {
        double from = Clock.Now;
        while (Controllers.Vibrates(XRNode.RightHand) && Clock.Now < from + 2.0)
        {
            Player.Tick(1f / 72f);
            Thread.Sleep(1);
        }
        return 1e3 * (Clock.Now - from);
    }

    static string Text(double value)
    {
        return value.ToString("f3", CultureInfo.InvariantCulture);
    }
}
