// A hand with a controller strokes a board beside no service, then beside one, and then without it again.
using System;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.XR;
using Object = UnityEngine.Object;

public static class FeltRooms
{
    const string Nobody = "ws://127.0.0.1:9/";

    public static void Run(string program, string url)
    {
        switch (program)
        {
            case "felt-auto": Auto(url); break;
            case "felt-baked": Baked(); break;
            case "felt-scene": BakedScene(); break;
            case "felt-survives": Survive(url); break;
        }
    }

    static void Auto(string url)
    {
        HapticClient client = Components.Client(Nobody);
        HapticObject board = Moves.Box("Board", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f), "wood");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => haptics.Amplitude > 0f && Said("felt from the bake now, because no service answers"), "nothing is felt without a service");
        Components.Say("without a service felt by " + client.FeltBy + " silence " + haptics.Silence);
        client.Connect(url);
        int served = 0;
        Action<Vibration> count = vibration => served++;
        client.Connection.Arrivals.Vibrated += count;
        Stroke(hand, () => served > 3 && client.FeltBy == FeltMode.Service && haptics.Amplitude > 0f && Said("felt from the service now"), "the service is not felt");
        Components.Say("with a service felt by " + client.FeltBy + " decided " + board.Material + " silence " + haptics.Silence);
        client.Mode = FeltMode.Baked;
        Components.Say("switched by hand plays on " + (haptics.Amplitude > 0f) + " connected " + (client.Connection != null));
        Stroke(hand, () => haptics.Amplitude > 0f && client.FeltBy == FeltMode.Baked, "the bake is not felt");
        client.Stop();
        Player.Tick();
        float after = 0f;
        Stroke(hand, 30, () => after = Math.Max(after, haptics.Amplitude));
        Components.Say("stopped " + after + " silence " + haptics.Silence);
        hand.transform.position = new Vector3(0f, 0f, 1f);
        Components.RunFor(30);
        Components.Say("let go " + haptics.Amplitude);
        hand.transform.position = new Vector3(-2f, 0f, 0.06f);
        Stroke(hand, () => haptics.Amplitude > 0f, "the stop does not end");
        Components.Say("felt again exceptions " + Debug.Exceptions + " errors " + Debug.Errors);
        Object.Destroy(client.gameObject);
        Components.RunFor(2);
        Components.Say("without a client " + haptics.Amplitude);
        Components.EndOfThreads();
    }

    // Nothing connects; objects without a material are told of; a script plays an effect.
    static void Baked()
    {
        HapticClient client = Client(null);
        Moves.Box("Xyzzy", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f));
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => haptics.Silence != null, "nobody is told");
        Components.Say("amplitude " + haptics.Amplitude + " silence " + haptics.Silence);
        Components.Say("status " + client.Status + " connected " + (client.Connection != null) + " threads " + HapticConnection.Running);
        hand.transform.position = new Vector3(0f, 0f, 1f);
        Components.RunFor(10);
        bool isPlayed = false;
        Components.Run(() =>
        {
            if (!client.IsPlaying(HandSide.Right)) isPlayed = client.Play("metal", HandGesture.Strike, HandSide.Right, 1f, 4f, 0.05f); // a worker thread may still be opening the bake
            return haptics.Amplitude > 0f;
        }, "an effect is not felt");
        Components.Run(() => !client.IsPlaying(HandSide.Right), "an effect does not end");
        Components.Say("effect " + isPlayed + " warnings " + Debug.Warnings + " exceptions " + Debug.Exceptions);
        Object.Destroy(client.gameObject);
    }

    // What the scene does not state, a bake knows; a script that states something else is felt at once.
    static void BakedScene()
    {
        HapticObject box = Moves.Box("Xyzzy", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f));
        string surface = "{\"material\": \"stone\", \"belief\": 0.9, \"by\": \"name\", \"surface_c\": 22.0, \"surface_by\": \"ambient\", \"impact_gain\": 0.8}";
        HapticClient client = Client("{\"version\": 1, \"objects\": {\"" + box.ObjectId + "\": {\"surfaces\": [" + surface + "]}}, \"not_baked\": []}");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => haptics.Amplitude > 0f, "the bake is not felt");
        box.State("unobtainium");
        Stroke(hand, () => haptics.Amplitude == 0f, "a script does not override the bake");
        Components.Say("overridden, errors " + Debug.Errors);
        Object.Destroy(client.gameObject);
        Components.RunFor(2);
        client = Client("{\"version\": 2, \"objects\": {}}");
        Components.Run(() => Debug.Errors > 0, "a bake of another version is taken");
        Components.RunFor(5);
        foreach (string line in Debug.Lines) Components.Say(line);
        Object.Destroy(client.gameObject);
    }

    // Strokes at 72 frames a second until standard input ends; prints the longest time without vibration and the longest frame.
    static void Survive(string url)
    {
        HapticClient client = Components.Client(url);
        Moves.Box("Board", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f), "wood");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => client.FeltBy == FeltMode.Service && client.State == LinkState.Ready && haptics.Amplitude > 0f, "the service is not felt");
        Console.WriteLine("stroking");
        bool ends = false;
        var reader = new System.Threading.Thread(() =>
        {
            Console.In.ReadToEnd();
            ends = true;
        }) { IsBackground = true };
        reader.Start();
        double gap = 0.0, frame = 0.0, felt = Clock.Now, last = felt;
        int baked = 0, frames = 0;
        for (; !System.Threading.Volatile.Read(ref ends); frames++)
        {
            Move(hand);
            Player.Tick();
            double now = Clock.Now;
            frame = Math.Max(frame, now - last);
            last = now;
            if (client.FeltBy == FeltMode.Baked) baked++;
            if (Controllers.Vibrates(XRNode.RightHand)) felt = now;
            gap = Math.Max(gap, now - felt);
            System.Threading.Thread.Sleep(Math.Max(0, (int)(1e3 * (now + 1.0 / 72.0 - Clock.Now))));
        }
        Components.Say("gap_ms " + (int)(1e3 * gap) + " longest_frame_ms " + (int)(1e3 * frame) + " baked " + baked + " of " + frames + " exceptions " + Debug.Exceptions);
        Object.Destroy(client.gameObject);
        Components.EndOfThreads();
    }

    static HapticClient Client(string materials)
    {
        var holder = new GameObject("client");
        holder.SetActive(false);
        var client = holder.AddComponent<HapticClient>();
        Components.Private(client, "mode", FeltMode.Baked);
        if (materials != null) Components.Private(client, "bakedMaterials", new TextAsset(materials));
        holder.SetActive(true);
        return client;
    }

    static bool Said(string text)
    {
        lock (Debug.Lines) return Debug.Lines.Exists(line => line.Contains(text));
    }

    static void Stroke(HapticHand hand, Func<bool> isDone, string what)
    {
        Components.Run(() =>
        {
            Move(hand);
            return isDone();
        }, what);
    }

    static void Stroke(HapticHand hand, int frames, Action each)
    {
        for (int i = 0; i < frames; i++)
        {
            Move(hand);
            Components.RunFor(1);
            each();
        }
    }

    // Back and forth along the board, 0.4 m/s.
    static void Move(HapticHand hand)
    {
        Vector3 at = hand.transform.position;
        float x = at.x + 0.4f / 72f;
        hand.transform.position = new Vector3(x > 3f ? -3f : x, at.y, at.z);
    }
}
