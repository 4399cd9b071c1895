// A hand touches while the service behind it dies, freezes and comes back, on a clock of our own.
// Felt and the controller's plan are the package's; the service is a player that answers as a service does.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using HapticVLM;
using HapticVLM.Baked;
using HapticVLM.Wire;
using UnityEngine;
using Feel = HapticVLM.Baked.Feel;

public sealed class FeltSwitch
{
    enum State { Alive, Frozen, Dead }

    const double Step = 0.001, FrameS = 1.0 / 72.0, AnswerS = 0.002, PlanEveryS = 0.04, TelemetryEveryS = 0.1, ReconnectS = 0.25;
    const int HeardHz = 8000;
    const double Strike = 0.2; // the vibration of a struck glass is above it
    const int FramesPerTouch = 2; // as the hand renews at 40 Hz where 72 frames are drawn a second

    static Feel feel;

    double now = 1.0, since, frameAt, plannedAt, toldAt, revivedAt;
    int frames;
    State state = State.Alive;
    FeltLink link = new FeltLink { IsConnected = true, IsOwner = true };
    FeelPlayer service = new FeelPlayer(feel);
    readonly Queue<KeyValuePair<double, Vibration>> underWay = new Queue<KeyValuePair<double, Vibration>>(); // null: another message
    readonly Queue<Vibration> arrived = new Queue<Vibration>();
    readonly VibrationPlan motor = new VibrationPlan();
    readonly List<KeyValuePair<double, double>> played = new List<KeyValuePair<double, double>>();
    readonly Felt felt;
    readonly FeelPlayer heard = new FeelPlayer(feel, HeardHz);
    readonly float[] wave = new float[(int)(HeardHz * FrameS)];
    readonly List<KeyValuePair<double, double>> sounds = new List<KeyValuePair<double, double>>();

    // `how`: alone, without a service, or beside another scene, which owns the outputs.
    FeltSwitch(FeltMode mode, string how)
    {
        felt = new Felt(() => link, hand => FeelForm.Amplitude);
        felt.Open(feel);
        felt.Switch(mode, now);
        felt.Vibrated += plan =>
        {
            if (plan.Hand == HandName.Right && plan.Amplitude.Count == 0) motor.Silence();
            else if (plan.Hand == HandName.Right) motor.Take(plan, now);
        };
        felt.Touched += (hand, touch) =>
        {
            Mute();
            heard.Touch(touch, now);
        };
        felt.Stopped += heard.Stop;
        if (how == "alone") Change(State.Dead);
        link.IsOwner = how != "beside";
    }

    // Follows the scripts of tests/support/switch_cases.py on standard input, and says what they ask for.
    public static void Run()
    {
        feel = Feel.Open(Resources.Load<TextAsset>("HapticVLM/feel.true").text);
        FeltSwitch one = null;
        string name = null;
        for (string line = Console.In.ReadLine(); line != null; line = Console.In.ReadLine())
        {
            string[] words = line.Split(' ');
            if (words[0] == "case") name = line.Substring(5);
            else if (words[0] == "begin") one = new FeltSwitch(Named<FeltMode>(words[1]), words.Last());
            else if (words[0] == "say" && words[2] == "because") continue; // the switch itself does not tell it
            else if (words[0] == "say") Components.Say("said\t" + name + "\t" + words[1] + "\t" + one.Seen(words[2]));
            else one.Do(words);
        }
    }

    void Do(string[] words)
    {
        switch (words[0])
        {
            case "pass": Pass(0.001 * int.Parse(words[1]), words.Length < 3 ? (Action)null : () => Touch(Named<Phase>(words[2]), words[3])); break;
            case "touch": Touch(Named<Phase>(words[1]), words[2]); break;
            case "service": Change(Named<State>(words[1])); break;
            case "stop": StopBy(words.Last()); break;
            case "mode": felt.Switch(Named<FeltMode>(words[1]), now); break;
            case "own": link.IsOwner = true; break;
            case "mark": since = now; break;
            default: throw new ArgumentException(words[0]);
        }
    }

    string Seen(string what)
    {
        switch (what)
        {
            case "felt": return Text(Loudest(played, since));
            case "heard": return Text(Loudest(sounds, since));
            case "gap": return Text(1e3 * LongestGap());
            case "soon": return Text(1e3 * (played.First(each => each.Key >= since && each.Value >= Strike).Key - since));
            case "by": return felt.By(now).ToString().ToLowerInvariant();
            default: return felt.IsStopped ? "stopped: release and touch again" : "";
        }
    }

    static T Named<T>(string word)
    {
        return (T)Enum.Parse(typeof(T), word, true);
    }

    // A stop by the scene, by another client, or of the left hand, of which the service tells.
    void StopBy(string who)
    {
        if (who == "left") felt.Serve(new Vibration { Hand = HandName.Left, PeriodMs = 12.5, Stopped = true });
        if (who == "stop")
        {
            felt.Stop(now);
            motor.Silence(); // as Controller Haptics does at a stop
        }
        if (who == "left" || state != State.Alive) return;
        service.Stop();
        Answer(new Vibration { Hand = HandName.Right, PeriodMs = 12.5, Stopped = true });
    }

    void Change(State to)
    {
        if (to == State.Alive && state == State.Dead)
        {
            revivedAt = now;
            service = new FeelPlayer(feel);
        }
        state = to;
        if (to != State.Dead) return;
        link = new FeltLink { ReceivedAt = double.NegativeInfinity };
        underWay.Clear();
    }

    void Touch(Phase phase, string material)
    {
        var touch = new Touch { Phase = phase, Hand = HandName.Right, ObjectId = material, SpeedMps = 0.5, ForceN = 2.0, CapturedAt = now };
        bool isSent = link.IsConnected && link.IsOwner && felt.Mode != FeltMode.Baked;
        var surface = new FeltSurface { Material = material };
        felt.Touch(ref touch, surface, now);
        if (!isSent || state != State.Alive) return;
        bool isOnset = service.Touch(new FeltTouch { Phase = phase.ToString().ToLowerInvariant(), Hand = "right", SpeedMps = 0.5, ForceN = 2.0, Surface = surface }, now);
        if (isOnset) Plan();
        Answer(null);
    }

    void Plan()
    {
        FeltPlan plan = service.Plan("right", "amplitude", now);
        if (plan.Amplitude.Length > 0) Answer(new Vibration { Hand = HandName.Right, PeriodMs = 1e3 * plan.PeriodS, Amplitude = plan.Amplitude.ToList() });
    }

    void Answer(Vibration vibration)
    {
        underWay.Enqueue(new KeyValuePair<double, Vibration>(now + AnswerS, vibration));
    }

    // Lets time pass; `touch` is called in every second frame.
    void Pass(double seconds, Action touch)
    {
        for (double end = now + seconds; now < end - 1e-9; now += Step)
        {
            Serve();
            if (now < frameAt) continue;
            frameAt = now + FrameS;
            while (arrived.Count > 0) felt.Serve(arrived.Dequeue());
            felt.Tick(now);
            Mute();
            heard.Render(wave, wave.Length, now);
            sounds.Add(new KeyValuePair<double, double>(now, wave.Max(sample => Math.Abs(sample))));
            double hz;
            played.Add(new KeyValuePair<double, double>(now, motor.RemainingS(now) > 0.0 ? motor.Strongest(now, FrameS, out hz) : 0.0));
            if (touch != null && frames++ % FramesPerTouch == 0) touch();
        }
    }

    void Serve()
    {
        if (state != State.Alive) return;
        if (!link.IsConnected && now - revivedAt >= ReconnectS) link = new FeltLink { IsConnected = true, IsOwner = true, ReceivedAt = now };
        if (!link.IsConnected) return;
        if (now - plannedAt >= PlanEveryS)
        {
            plannedAt = now;
            Plan();
        }
        if (now - toldAt >= TelemetryEveryS)
        {
            toldAt = now;
            Answer(null);
        }
        while (underWay.Count > 0 && underWay.Peek().Key <= now)
        {
            Vibration vibration = underWay.Dequeue().Value;
            link.ReceivedAt = now;
            if (vibration != null) arrived.Enqueue(vibration);
        }
    }

    // As a Felt Speaker does.
    void Mute()
    {
        heard.Mute("right", !felt.IsBaked(HandName.Right, now));
    }

    static double Loudest(List<KeyValuePair<double, double>> values, double since)
    {
        return values.Where(each => each.Key >= since).Select(each => each.Value).DefaultIfEmpty().Max();
    }

    // The longest time without vibration since the mark, from the end of the last frame that had some.
    double LongestGap()
    {
        double gap = 0.0, last = since;
        foreach (KeyValuePair<double, double> each in played.Where(each => each.Key >= since))
        {
            if (each.Value > 0.0) last = each.Key + FrameS;
            gap = Math.Max(gap, each.Key + FrameS - last);
        }
        return gap;
    }

    static string Text(double value)
    {
        return value.ToString("f3", CultureInfo.InvariantCulture);
    }
}
