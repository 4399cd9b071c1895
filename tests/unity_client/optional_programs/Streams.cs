// Prints the calls of Meta's parametric interface while a hand slides at 72 frames a second, and at its stop.
using System;
using HapticVLM;
using HapticVLM.Wire;

public static class Streams
{
    public static int Main(string[] arguments)
    {
        if (arguments.Length > 0) return SampledTouches.Run();
        var output = new MetaOutput();
        var plan = new VibrationPlan();
        var slide = new Vibration { PeriodMs = 5.0 };
        for (int i = 0; i < 20; i++) slide.Amplitude.Add(0.3);
        for (int frame = 0; frame < 10; frame++)
        {
            double now = 100.0 + frame / 72.0;
            if (frame % 3 == 0) plan.Take(slide, now);
            output.Play(HandSide.Right, plan, now, 2f, 0f);
        }
        output.Stop(HandSide.Right);
        foreach (string line in OVRInput.Sent) Console.WriteLine(line);
        return 0;
    }
}
