// A hand strokes and strikes for minutes while the service behind it dies, freezes and comes back, on a clock of our own.
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
    const int FramesPerTouch = 2; // as the hand renews at 40 Hz where 72 frames are drawn a second

    static Feel feel;

    double now = 1.0, frameAt, plannedAt, toldAt, revivedAt;
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

    FeltSwitch(FeltMode mode, bool hasService = true)
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
        if (!hasService) Change(State.Dead);
    }

    public static void Run(int changes)
    {
        feel = Feel.Open(Resources.Load<TextAsset>("HapticVLM/feel.true").text);
        foreach (State to in new[] { State.Dead, State.Frozen })
        {
            Stroke(to, changes);
            Strikes(to, changes);
        }
        Stopped(true);
        Stopped(false);
        StoppedByAnother();
        StoppedMeanwhile();
        Mode(FeltMode.Auto, true);
        Mode(FeltMode.Auto, false);
        Mode(FeltMode.Baked, true);
        Mode(FeltMode.Service, false);
        BesideAnother();
        SwitchByHand(changes);
    }

    // Strokes through many changes.
    static void Stroke(State to, int changes)
    {
        var one = new FeltSwitch(FeltMode.Auto);
        one.Begin("rubber");
        double since = one.now;
        var by = new HashSet<string>();
        for (int i = 0; i < changes; i++)
        {
            one.Change(to);
            one.Pass(0.3 + 0.007 * (i % 9), () => one.Touch(Phase.Slide, "rubber"));
            by.Add(one.felt.By(one.now).ToString());
            one.Change(State.Alive);
            one.Pass(0.75, () => one.Touch(Phase.Slide, "rubber"));
            by.Add(one.felt.By(one.now).ToString());
        }
        Components.Say("stroke " + to + " gap_ms " + Text(1e3 * one.LongestGap(since)) + " by " + string.Join(" ", by.OrderBy(each => each).ToArray()));
    }

    // Strikes at every moment around a change: from 60 ms before to 60 ms after it.
    static void Strikes(State to, int changes)
    {
        int lost = 0, unheard = 0;
        double weakest = 1.0, latest = 0.0;
        for (int i = 0; i < changes; i++)
        {
            var one = new FeltSwitch(FeltMode.Auto);
            one.Begin("glass");
            one.Touch(Phase.Release, null);
            one.Pass(0.3, null);
            double offset = -0.06 + 0.12 * i / changes;
            if (offset < 0.0) one.Change(to);
            one.Pass(Math.Abs(offset < 0.0 ? offset : 0.0), null);
            double since = one.now;
            one.Touch(Phase.Contact, "glass");
            one.Pass(Math.Max(0.0, offset), () => one.Touch(Phase.Contact, "glass"));
            if (offset >= 0.0) one.Change(to);
            one.Pass(0.16, () => one.Touch(Phase.Contact, "glass"));
            double strongest = one.Strongest(since);
            if (strongest < 0.2) lost++;
            if (offset < 0.0 && Loudest(one.sounds, since) < 0.3) unheard++;
            weakest = Math.Min(weakest, strongest);
            latest = Math.Max(latest, one.played.First(each => each.Key >= since && (each.Value >= 0.2 || strongest < 0.2)).Key - since);
        }
        Components.Say("strikes " + to + " lost " + lost + " unheard " + unheard + " weakest " + Text(weakest) + " latest_ms " + Text(1e3 * latest));
    }

    // A stop in the middle of a stroke that goes on; then the other one takes over, and has to hold as well. A service that
    // begins after the stop does not know of it.
    static void Stopped(bool hasService)
    {
        var one = new FeltSwitch(FeltMode.Auto, hasService);
        one.Begin("stone");
        one.felt.Stop(one.now);
        if (one.state == State.Alive) one.StopService();
        one.motor.Silence(); // as Controller Haptics does at a stop
        one.Pass(0.03, null);
        double since = one.now;
        one.Change(hasService ? State.Dead : State.Alive);
        one.Pass(2.0, () => one.Touch(Phase.Slide, "stone"));
        double held = one.Strongest(since), sound = Loudest(one.sounds, since);
        one.Touch(Phase.Release, null);
        one.Pass(0.05, null);
        double again = one.now;
        one.Touch(Phase.Contact, "stone");
        one.Pass(0.2, () => one.Touch(Phase.Slide, "stone"));
        Components.Say("stop " + (hasService ? "with" : "without") + " a service held " + Text(held) + " heard " + Text(sound) + " again " + (one.Strongest(again) > 0.0));
    }

    // An operator stops the service, which dies while the hand strokes on.
    static void StoppedByAnother()
    {
        var one = new FeltSwitch(FeltMode.Auto);
        one.Begin("stone");
        one.StopService();
        one.Pass(0.05, () => one.Touch(Phase.Slide, "stone"));
        double since = one.now;
        one.Change(State.Dead);
        one.Pass(0.9, () => one.Touch(Phase.Slide, "stone"));
        Components.Say("stopped by another held " + Text(one.Strongest(since)) + " heard " + Text(Loudest(one.sounds, since)));
    }

    // The service swallows a strike, tells that the other hand was stopped, and dies.
    static void StoppedMeanwhile()
    {
        var one = new FeltSwitch(FeltMode.Auto);
        one.Begin("glass");
        one.Touch(Phase.Release, null);
        one.Pass(0.3, null);
        one.Change(State.Frozen);
        double since = one.now;
        one.Touch(Phase.Contact, "glass");
        one.felt.Serve(new Vibration { Hand = HandName.Left, PeriodMs = 12.5, Stopped = true });
        one.Change(State.Dead);
        one.Pass(0.14, null);
        Components.Say("stop of a missed strike held " + Text(one.Strongest(since)) + " heard " + Text(Loudest(one.sounds, since)) + " stopped " + one.felt.IsStopped);
        one.Touch(Phase.Release, null);
        one.Touch(Phase.Contact, "glass");
        Components.Say("touched again stopped " + one.felt.IsStopped);
    }

    static void Mode(FeltMode mode, bool hasService)
    {
        var one = new FeltSwitch(mode, hasService);
        one.Begin("stone");
        double since = one.now;
        one.Pass(0.3, () => one.Touch(Phase.Slide, "stone"));
        Components.Say("mode " + mode + (hasService ? " with" : " without") + " a service felt " + (one.Strongest(since) > 0.0) + " heard " + (Loudest(one.sounds, since) > 0.0) + " by " + one.felt.By(one.now));
    }

    // The service serves another scene, then this one.
    static void BesideAnother()
    {
        var one = new FeltSwitch(FeltMode.Auto);
        one.link.IsOwner = false;
        one.Begin("stone");
        double since = one.now;
        one.Pass(1.5, () => one.Touch(Phase.Slide, "stone"));
        string beside = "felt " + (one.Strongest(since) > 0.0) + " by " + one.felt.By(one.now);
        one.link.IsOwner = true;
        one.Pass(0.5, () => one.Touch(Phase.Slide, "stone"));
        Components.Say("beside another " + beside + " then by " + one.felt.By(one.now) + " gap_ms " + Text(1e3 * one.LongestGap(since)));
    }

    // A person turns the switch while stroking.
    static void SwitchByHand(int changes)
    {
        var one = new FeltSwitch(FeltMode.Service);
        one.Begin("rubber");
        double since = one.now;
        for (int i = 0; i < changes; i++)
        {
            one.felt.Switch(i % 2 == 0 ? FeltMode.Baked : i % 4 == 1 ? FeltMode.Service : FeltMode.Auto, one.now);
            one.Pass(0.2 + 0.003 * (i % 7), () => one.Touch(Phase.Slide, "rubber"));
        }
        Components.Say("by hand gap_ms " + Text(1e3 * one.LongestGap(since)));
    }

    void Begin(string material)
    {
        Pass(1.5, null);
        Touch(Phase.Contact, material);
        Pass(0.3, () => Touch(Phase.Slide, material));
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

    void StopService()
    {
        service.Stop();
        Answer(new Vibration { Hand = HandName.Right, PeriodMs = 12.5, Stopped = true });
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

    double Strongest(double since)
    {
        return Loudest(played, since);
    }

    static double Loudest(List<KeyValuePair<double, double>> values, double since)
    {
        return values.Where(each => each.Key >= since).Select(each => each.Value).DefaultIfEmpty().Max();
    }

    // The longest time without vibration after `since`, from the end of the last frame that had some.
    double LongestGap(double since)
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
