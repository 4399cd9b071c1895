// Runs the package's components in the stub player against the real service and prints the results.
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;
using Unity.Collections;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

public static class Components
{
    static readonly List<string> Log = new List<string>();

    // Runs the program that is named, such as Moves.Carry, with the arguments that it takes.
    public static int Main(string[] arguments)
    {
        string[] named = arguments[0].Split('.');
        MethodInfo program = typeof(Components).Assembly.GetType(named[0]).GetMethod(named[1], BindingFlags.Static | BindingFlags.Public | BindingFlags.NonPublic);
        string pictures = Environment.GetEnvironmentVariable("PICTURES");
        if (pictures != null)
        {
            ImageConversion.Jpeg = File.ReadAllBytes(Path.Combine(pictures, "picture.jpg"));
            ImageConversion.Png = File.ReadAllBytes(Path.Combine(pictures, "mask.png"));
        }
        program.Invoke(null, Array.ConvertAll(program.GetParameters(), one => Convert.ChangeType(arguments[one.Position + 1], one.ParameterType)));
        lock (Debug.Lines) Log.AddRange(Debug.Lines);
        EndOfThreads();
        foreach (string line in Log) Console.WriteLine(line);
        Console.Out.Flush();
        Leave(0); // Mono's own end aborts its threads, one of which may fail by that
        return 0;
    }

    [DllImport("libc", EntryPoint = "_exit")]
    static extern void Leave(int status);

    public static void Say(string line)
    {
        Log.Add(line);
    }

    // Adds a component to an object of its own, and sets it up before it wakes, as a saved scene does.
    public static T Made<T>(string name, Action<T> setUp) where T : Component, new()
    {
        var holder = new GameObject(name);
        holder.SetActive(false);
        var made = holder.AddComponent<T>();
        setUp(made);
        holder.SetActive(true);
        return made;
    }

    public static HapticClient Client(string url)
    {
        return Made<HapticClient>("client", client => client.Connect(url));
    }

    public static HapticObject Thing(string name, string material = null)
    {
        var thing = new GameObject(name);
        thing.AddComponent<MeshFilter>().sharedMesh = new Mesh();
        var renderer = thing.AddComponent<MeshRenderer>();
        renderer.bounds = new Bounds(new Vector3(0f, 0f, 2f), new Vector3(1f, 1f, 1f));
        renderer.sharedMaterial = new Material { name = name };
        var collider = thing.AddComponent<BoxCollider>();
        collider.bounds = renderer.bounds;
        Physics.World.Add(collider);
        var one = thing.AddComponent<HapticObject>();
        if (material != null) one.State(material);
        return one;
    }

    public static void Run(Func<bool> isDone, string what, double seconds = 120.0)
    {
        double until = Clock.Now + seconds;
        while (!isDone())
        {
            if (Clock.Now > until) throw new TimeoutException(what);
            Player.Tick();
            Thread.Sleep(2);
        }
    }

    public static void RunFor(int frames)
    {
        for (int i = 0; i < frames; i++)
        {
            Player.Tick();
            Thread.Sleep(2);
        }
    }

    static void Touching(string url)
    {
        HapticClient client = Client(url);
        HapticObject oak = Thing("OakPlanks"), pane = Thing("Pane", "glass");
        var painted = pane.gameObject.GetComponent<Renderer>().sharedMaterial;
        painted.Set("_Metallic", 0.0f);
        painted.Set("_Smoothness", 0.95f);
        painted.Set("_BaseColor", new Color(2f, 0.5f, 0.5f, 0.25f));
        painted.renderQueue = 3000;
        var hand = Moves.Hand(new Vector3(0f, 0f, 1.45f));
        Run(() => client.State == LinkState.Ready, "no welcome");
        Run(() => oak.Material != null, "no decision on approach");
        Say("approach decides " + oak.Material + " by " + oak.Source);
        var hit = new Collision { collider = oak.gameObject.GetComponent<Collider>(), impulse = new Vector3(0f, 0.03f, 0.04f), relativeVelocity = new Vector3(0.3f, 0f, 0f) };
        Requests requests = client.Connection.Outbox.Requests;
        Player.Send(hand.gameObject, "OnCollisionEnter", hit);
        Say("touches " + (hand.TouchedObjectId == oak.ObjectId));
        RunFor(40);
        Player.Send(hand.gameObject, "OnTriggerEnter", pane.gameObject.GetComponent<Collider>());
        Run(() => pane.Material != null, "no decision of the pane");
        Say("then " + pane.Material + " by " + pane.Source);
        Object.Destroy(pane.gameObject);
        RunFor(2);
        Say("back to the first " + (hand.TouchedObjectId == oak.ObjectId));
        Player.ResetFigures();
        RunFor(100);
        Say("while touching longest_ms " + Player.LongestMs.ToString("r"));
        Player.Send(hand.gameObject, "OnCollisionExit", hit);
        Say("let go " + (hand.TouchedObjectId == null));
        Run(() => requests.TouchesAnswered == requests.TouchesSent, "touches are not answered");
        Say("touches sent " + requests.TouchesSent + " refused " + client.Connection.TouchesRefused);
        client.Stop();
        PauseAndResume(client);
        Object.Destroy(client.gameObject);
    }

    // Names in a hierarchy, with materials whose names say nothing: what each is decided to be.
    static void Hierarchy(string url)
    {
        HapticClient client = Client(url);
        var rifle = new GameObject("Rifle");
        var far = new GameObject(new string('x', 250));
        rifle.transform.SetParent(far.transform, false);
        HapticObject magazine = Child(rifle, "Magazine", "Dungeon_Set_Foobar");
        HapticObject chest = Child(null, "WoodenChest", "Dungeon_Set_Foobar");
        HapticObject vase = Child(null, "Vase", "BrushedSteel");
        var hand = Moves.Hand(new Vector3(0f, 0f, 9f));
        Run(() => client.State == LinkState.Ready, "no welcome");
        // An earlier scene may have stopped the outputs of this service. A release lifts that.
        Player.Send(hand.gameObject, "OnTriggerEnter", vase.gameObject.GetComponent<Collider>());
        RunFor(10);
        Player.Send(hand.gameObject, "OnTriggerExit", vase.gameObject.GetComponent<Collider>());
        RunFor(10);
        foreach (var each in new[] { magazine, chest, vase })
        {
            Player.Send(hand.gameObject, "OnTriggerEnter", each.gameObject.GetComponent<Collider>());
            Run(() => each.Material != null, "no decision of " + each.name);
            Say(each.name + " is " + each.Material + " by " + each.Source);
            Player.Send(hand.gameObject, "OnTriggerExit", each.gameObject.GetComponent<Collider>());
        }
        Object.Destroy(client.gameObject);
    }

    static HapticObject Child(GameObject parent, string name, string material)
    {
        var thing = new GameObject(name);
        thing.SetActive(false);
        if (parent != null) thing.transform.SetParent(parent.transform, false);
        thing.AddComponent<MeshFilter>().sharedMesh = new Mesh();
        thing.AddComponent<MeshRenderer>().sharedMaterial = new Material { name = material };
        Physics.World.Add(thing.AddComponent<BoxCollider>());
        var felt = thing.AddComponent<HapticObject>();
        thing.SetActive(true);
        return felt;
    }

    static void PauseAndResume(HapticClient client)
    {
        Player.Send(client.gameObject, "OnApplicationPause", true);
        Say("paused " + client.State);
        Player.Send(client.gameObject, "OnApplicationPause", false);
        Run(() => client.State == LinkState.Ready, "it does not resume");
        Say("resumed " + client.State + " warnings " + Warnings());
    }

    static void Streaming(string url)
    {
        HapticClient client = Client(url);
        var streamer = Streamer(true, false);
        Run(() => client.State == LinkState.Ready, "no welcome");
        int answers = 0;
        client.Decided += _ => answers++;
        Run(() => streamer.Sent >= 10 && answers > 0, "no frame is sent or answered");
        AsyncGPUReadback.IsDeviceLost = true;
        Run(() => streamer.Errors >= 1, "device loss is not noticed");
        int sent = streamer.Sent;
        Run(() => streamer.Errors >= 4, "it does not go on trying");
        Say("sent while lost " + (streamer.Sent - sent));
        AsyncGPUReadback.IsDeviceLost = false;
        Run(() => streamer.Sent > sent + 3, "it does not recover");
        Say("recovered in_flight " + AsyncGPUReadback.MostInFlight + " exceptions " + Debug.Exceptions);
        RunFor(150); // the first message of each kind builds what the later ones use again
        Player.ResetFigures();
        long before = streamer.Sent;
        RunFor(600);
        Say("frames 600 pictures " + (streamer.Sent - before) + " allocated " + Player.AllocatedBytes + " longest_ms " + Player.LongestMs.ToString("r"));
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
        RunFor(20);
        FramePipe_Leaks();
    }

    // Follows the README: the sample's component, and a hand that enters its first cube.
    static void Sample(string url, string assembly)
    {
        HapticClient client = Client(url);
        Type type = Assembly.LoadFrom(assembly).GetType("HapticVLM.Samples.FeelByName");
        typeof(GameObject).GetMethod("AddComponent").MakeGenericMethod(type).Invoke(new GameObject("empty"), null);
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 9f));
        Run(() => client.State == LinkState.Ready, "no welcome");
        Collider table = GameObject.Scene.Find(one => one.name == "OakTable").GetComponent<Collider>();
        Player.Send(hand.gameObject, "OnTriggerEnter", table);
        HapticObject touched = table.GetComponentInParent<HapticObject>();
        Run(() => touched.Material != null, "no decision");
        Say(Debug.LastLog);
        Object.Destroy(hand.gameObject);
        Object.Destroy(client.gameObject);
    }

    // No service answers at the scene's address until a user types the right one.
    static void TypeAddress(string url, string assembly)
    {
        HapticClient client = Client("ws://127.0.0.1:9/");
        Type type = Assembly.LoadFrom(assembly).GetType("HapticVLM.Samples.AskForAddress");
        TouchScreenKeyboard.Typed = url + " typed-token";
        typeof(GameObject).GetMethod("AddComponent").MakeGenericMethod(type).Invoke(new GameObject("asker"), null);
        Run(() => client.State == LinkState.Ready, "no link after an address was typed", 60.0);
        Say("linked and remembered " + (ServiceAddress.Url("") == url) + " " + ServiceAddress.Token(""));
        Object.Destroy(client.gameObject);
    }

    static void Cycles(string url)
    {
        HapticClient client = Client(url);
        HapticObject thing = Thing("thing");
        var streamer = Streamer(true, false);
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 9f));
        ImageConversion.EncodeMs = 3;
        for (int i = 0; i < 100; i++)
        {
            foreach (Behaviour one in new Behaviour[] { streamer, hand, thing, client }) one.enabled = false;
            if (i % 2 == 0) RunFor(1);
            foreach (Behaviour one in new Behaviour[] { client, thing, hand, streamer }) one.enabled = true;
            RunFor(i % 5);
            if (i % 10 == 0) Run(() => client.State == LinkState.Ready, "cycle " + i + " does not connect");
        }
        Run(() => client.State == LinkState.Ready && streamer.Sent > 0, "nothing works after 100 cycles");
        Say("works after 100 cycles");
        streamer.enabled = false;
        HapticClient.AbortActive(); // as before a domain reload
        Object.Destroy(client.gameObject);
        FramePipe_Leaks();
        Say("exceptions " + Debug.Exceptions);
    }

    static void Scanning(string url)
    {
        HapticClient client = Client(url);
        HapticObject named = Thing("OakPlanks"), unsure = Thing("Xyzzy"), stated = Thing("Abc", "metal");
        unsure.gameObject.layer = 5;
        var streamer = Streamer(false, true);
        Run(() => client.State == LinkState.Ready, "no welcome");
        Run(() => streamer.IsScanDone && streamer.Sent > 0, "the scan does not end");
        Run(() => named.Material != null && unsure.Material != null, "no decisions after the scan");
        Say("scan sent " + streamer.Sent + " named " + named.Material + " unsure_layer " + unsure.gameObject.layer + " stated " + (stated.Material ?? "not shown"));
        int sent = streamer.Sent;
        streamer.Capture(unsure);
        Run(() => streamer.Sent > sent, "no picture on demand");
        Say("on demand warnings " + Warnings() + " exceptions " + Debug.Exceptions);
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
        RunFor(20);
        FramePipe_Leaks();
    }

    public static FrameStreamer Streamer(bool isContinuous, bool scans)
    {
        return Made<FrameStreamer>("streamer", streamer =>
        {
            Private(streamer, "isContinuous", isContinuous);
            Private(streamer, "scansObjects", scans);
            Private(streamer, "framesPerSecond", 30f);
            Private(streamer, "sizePx", 128);
        });
    }

    // Sets serialised fields by reflection, as the engine does.
    public static T Private<T>(object of, string field)
    {
        return (T)of.GetType().GetField(field, BindingFlags.Instance | BindingFlags.NonPublic).GetValue(of);
    }

    public static void Private(object of, string field, object value)
    {
        of.GetType().GetField(field, BindingFlags.Instance | BindingFlags.NonPublic).SetValue(of, value);
    }

    // Without those of the link, because a busy machine may answer late.
    public static int Warnings()
    {
        lock (Debug.Lines) return Debug.Lines.FindAll(line => line.StartsWith("warning: ") && !line.Contains("Retrying automatically")).Count;
    }

    static void FramePipe_Leaks()
    {
        Say("left arrays " + NativeArray<byte>.Live + " textures " + RenderTexture.Live);
    }

    public static void End(HapticClient client)
    {
        Say("errors " + Debug.Errors + " exceptions " + Debug.Exceptions);
        Object.Destroy(client.gameObject);
    }

    static void EndOfThreads()
    {
        double until = Clock.Now + 30.0;
        while (HapticConnection.Running > 0 && Clock.Now < until) Thread.Sleep(5);
        Say("threads left " + HapticConnection.Running);
    }
}
