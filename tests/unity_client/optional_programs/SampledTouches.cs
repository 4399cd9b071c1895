// A controller whose runtime takes samples plays touches of the bake, then a stop, and then a runtime that takes none.
using System;
using System.Globalization;
using System.Reflection;
using System.Text;
using System.Threading;
using HapticVLM;
using UnityEngine;
using UnityEngine.XR.OpenXR;
using UnityEngine.XR.OpenXR.Input;

public static class SampledTouches
{
    const int FrameMs = 14;
    static HapticClient client;

    public static int Run()
    {
        StandInRuntime.Begin(new HapticPcmFeature());
        var holder = new GameObject("client");
        holder.SetActive(false);
        client = holder.AddComponent<HapticClient>();
        typeof(HapticClient).GetField("mode", BindingFlags.Instance | BindingFlags.NonPublic).SetValue(client, FeltMode.Baked);
        holder.SetActive(true);
        var hand = new GameObject("hand");
        hand.AddComponent<OpenXrOutput>();
        var haptics = hand.AddComponent<ControllerHaptics>();
        Play("fabric", HandGesture.Slide, 300f, () => StandInRuntime.Count > 0); // the files are open, and the code is compiled
        Play("fabric", HandGesture.Slide, 0.02f, () => !client.IsPlaying(HandSide.Right));
        foreach (string material in new[] { "wood", "glass" })
        {
            Wave(HandGesture.Strike, material);
            Wave(HandGesture.Slide, material);
        }
        Console.WriteLine("impulses " + OpenXRInput.Impulses + " appended " + (StandInRuntime.Appended > 0));
        int stops = StandInRuntime.Stops, count = StandInRuntime.Count;
        Play("wood", HandGesture.Slide, 300f, () => StandInRuntime.Count - count > 400);
        Console.WriteLine("bytes " + BytesOf(haptics, 40));
        count = StandInRuntime.Count;
        client.Stop();
        Console.WriteLine("stopped at once " + (StandInRuntime.Stops > stops) + " amplitude " + haptics.Amplitude);
        Frames(40);
        Console.WriteLine("after the stop " + (StandInRuntime.Count - count));
        StandInRuntime.SetRate(0f); // a controller that takes no samples
        Play("wood", HandGesture.Slide, 300f, () => OpenXRInput.Impulses > 0);
        Console.WriteLine("without samples amplitude " + (haptics.Amplitude > 0f));
        UnityEngine.Object.Destroy(holder);
        return Debug.Exceptions + Debug.Errors;
    }

    // Prints what the runtime takes of a touch.
    static void Wave(HandGesture gesture, string material)
    {
        int from = StandInRuntime.Count, seen = from;
        double last = Clock.Now;
        Play(material, gesture, gesture == HandGesture.Slide ? 1f : 0.3f, () =>
        {
            if (seen != StandInRuntime.Count || client.IsPlaying(HandSide.Right)) last = Clock.Now;
            seen = StandInRuntime.Count;
            return seen > from && Clock.Now - last > 0.3;
        });
        var line = new StringBuilder("wave " + gesture.ToString().ToLowerInvariant() + " " + material);
        for (int at = from; at < seen; at++) line.Append(' ').Append(StandInRuntime.Sample(at).ToString("R", CultureInfo.InvariantCulture));
        Console.WriteLine(line);
    }

    // Returns the managed memory that the component's frames take while they send samples.
    static long BytesOf(ControllerHaptics haptics, int frames)
    {
        var update = (Action)Delegate.CreateDelegate(typeof(Action), haptics, typeof(ControllerHaptics).GetMethod("Update", BindingFlags.Instance | BindingFlags.NonPublic));
        long bytes = 0;
        for (int frame = 0; frame < frames; frame++)
        {
            Frames(1);
            Thread.Sleep(FrameMs);
            int count = StandInRuntime.Count;
            long before = GC.GetAllocatedBytesForCurrentThread();
            update();
            bytes += GC.GetAllocatedBytesForCurrentThread() - before;
            if (StandInRuntime.Count == count) throw new InvalidOperationException("nothing was sent");
        }
        return bytes;
    }

    static void Play(string material, HandGesture gesture, float seconds, Func<bool> isDone)
    {
        client.Play(material, gesture, HandSide.Right, 0.3f, 1.5f, seconds);
        double until = Clock.Now + 300.0;
        while (!isDone())
        {
            if (Clock.Now > until) throw new TimeoutException(material);
            Frames(1);
        }
    }

    static void Frames(int count)
    {
        for (int frame = 0; frame < count; frame++)
        {
            Player.Tick();
            Thread.Sleep(FrameMs);
        }
    }
}
