// A scripted scene on the package's own connection, against the real service.
using System;
using System.Collections.Generic;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;

public sealed class ScriptedScene
{
    public readonly HapticConnection Connection;
    public readonly Dictionary<string, string> Materials = new Dictionary<string, string>();
    public readonly List<string> Errors = new List<string>();
    public double LongestCpuMs;

    public ScriptedScene(string url)
    {
        var settings = new ConnectionSettings { Url = new Uri(url), ClientName = "mono test", LongestRetryS = 0.5 };
        Connection = new HapticConnection(settings);
        Connection.Arrivals.Decided += OnDecided;
        Connection.Arrivals.Refused += error => Errors.Add(error.Code + ": " + error.Text);
        Connection.Outbox.Scene.SetAmbient(21.0);
        // Ids without meaning, because the service would read a meaningful id as a name.
        Connection.Outbox.Scene.Put(new SceneObject { ObjectId = "o1", Name = "Oak_Table_02" });
        Connection.Outbox.Scene.Put(new SceneObject { ObjectId = "o2", Material = "metal" });
        Connection.Outbox.Scene.Put(new SceneObject { ObjectId = "thing" });
        Connection.Open();
    }

    void OnDecided(Decision decision)
    {
        if (decision.ObjectId != null) Materials[decision.ObjectId] = decision.Material;
    }

    // One iteration of a main loop: an action, then the events, timed in CPU time of this thread.
    public void Turn(Action act)
    {
        double before = Machine.ThreadCpuMs();
        if (act != null) act();
        Connection.Pump();
        LongestCpuMs = Math.Max(LongestCpuMs, Machine.ThreadCpuMs() - before);
    }

    public void WaitUntil(Func<bool> isDone, string what, double seconds = 240.0)
    {
        double until = Clock.Now + seconds;
        while (!isDone())
        {
            Turn(null);
            if (Clock.Now > until) throw new TimeoutException(what + "; last error: " + Connection.LastError);
            Thread.Sleep(1);
        }
    }

    public bool Touch(Phase phase, string objectId)
    {
        var touch = new Touch
        {
            Phase = phase, ObjectId = objectId, Hand = HandName.Right, SpeedMps = 0.3, ForceN = 1.5, CapturedAt = Clock.Now,
        };
        return Connection.Send(ref touch);
    }

    public void End()
    {
        Connection.Close();
        double until = Clock.Now + 30.0;
        while (HapticConnection.Running > 0 && Clock.Now < until) Thread.Sleep(5);
        Console.WriteLine("threads left " + HapticConnection.Running);
    }
}

public static class Scenes
{
    // Sends touches one at a time and prints each round trip in ms.
    public static int RoundTrips(string url, int count)
    {
        var scene = new ScriptedScene(url);
        scene.WaitUntil(() => scene.Connection.State == LinkState.Ready, "no welcome");
        Requests requests = scene.Connection.Outbox.Requests;
        for (int i = 0; i < count; i++)
        {
            scene.Turn(() => scene.Touch(i % 2 == 0 ? Phase.Contact : Phase.Release, "o1"));
            scene.WaitUntil(() => requests.TouchesAnswered > i, "touch " + i + " is not answered");
        }
        var trips = new double[1024];
        int n = requests.RoundTrips(trips);
        for (int i = 0; i < n; i++) Console.WriteLine("ms " + trips[i].ToString("r"));
        Console.WriteLine("material " + scene.Materials["o1"]);
        scene.End();
        return 0;
    }

    // Connects to a service that refuses it, and prints the resulting state and the reason.
    public static int Refused(string url)
    {
        var scene = new ScriptedScene(url);
        scene.WaitUntil(() => scene.Connection.State == LinkState.Waiting, "the connection was not refused");
        Console.WriteLine(scene.Connection.State + ": " + scene.Connection.LastError);
        scene.End();
        return 0;
    }

    // Sends touches while the service is killed and restarted; each line on stdout requests a kill.
    public static int Restarts(string url, int rounds)
    {
        var scene = new ScriptedScene(url);
        Requests requests = scene.Connection.Outbox.Requests;
        for (int round = 1; round <= rounds; round++)
        {
            scene.WaitUntil(() => scene.Connection.State == LinkState.Ready && scene.Connection.Openings == round, "round " + round);
            scene.Materials.Clear();
            long sent = requests.TouchesSent, answered = requests.TouchesAnswered;
            int accepted = 0;
            for (int i = 0; i < 90; i++)
            {
                string target = i % 6 < 3 ? "o1" : "o2";
                Phase phase = i % 3 == 0 ? Phase.Contact : i % 3 == 1 ? Phase.Slide : Phase.Release;
                scene.Turn(() => { if (scene.Touch(phase, target)) accepted++; });
                scene.WaitUntil(() => scene.Connection.Outbox.Touches.Count == 0, "a touch is not sent");
            }
            scene.WaitUntil(() => requests.TouchesAnswered - answered == accepted, "touches are lost");
            scene.WaitUntil(() => scene.Materials.Count == 2, "not registered again");
            Console.WriteLine("round " + round + " accepted " + accepted + " sent " + (requests.TouchesSent - sent)
                + " answered " + (requests.TouchesAnswered - answered) + " table " + scene.Materials["o1"]
                + " kettle " + scene.Materials["o2"]);
            Console.Out.Flush();
            if (round <= 2) scene.LongestCpuMs = 0.0; // the first rounds include compilation
            int opened = round;
            double until = Clock.Now + 120.0;
            while (round < rounds && scene.Connection.Openings == opened && Clock.Now < until)
            {
                scene.Turn(() => scene.Touch(Phase.Slide, "o1"));
                Thread.Sleep(5);
            }
        }
        Console.WriteLine("errors " + string.Join("|", scene.Errors.ToArray()));
        Console.WriteLine("longest_cpu_ms " + scene.LongestCpuMs.ToString("r"));
        scene.End();
        return 0;
    }

}
