// A hand with a controller strokes a board beside no service, then beside one, and then without it again.
using System;
using System.Reflection;
using HapticVLM;
using HapticVLM.Baked;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.XR;
using Object = UnityEngine.Object;

public static class FeltRooms
{
    const string Nobody = "ws://127.0.0.1:9/";

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
        HapticClient client = Client("{\"version\": 2, \"objects\": {\"" + box.ObjectId + "\": {\"paths\": {\"scene\": [\"Room/Xyzzy\"]}, \"surfaces\": [" + surface + "]}}, \"not_baked\": []}");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => haptics.Amplitude > 0f, "the bake is not felt");
        Components.Say("copy " + Copied(box));
        box.State("unobtainium");
        Stroke(hand, () => haptics.Amplitude == 0f, "a script does not override the bake");
        Components.Say("overridden, errors " + Debug.Errors);
        Object.Destroy(box.gameObject);
        Moves.Box("Xyzzx", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f));
        Stroke(hand, () => haptics.Silence != null && haptics.Silence.Contains("Xyzzx"), "nobody is told");
        Components.Say("silence " + haptics.Silence + ", looked up once " + ReferenceEquals(haptics.Silence, haptics.Silence));
        Object.Destroy(client.gameObject);
        Components.RunFor(2);
        client = Client("{\"version\": 9, \"objects\": {}}");
        Components.Run(() => Debug.Errors > 0, "a bake of another version is taken");
        Components.RunFor(5);
        Object.Destroy(client.gameObject);
    }

    // A copy as Unity makes one at run time: the serialised id is that of its original.
    static string Copied(HapticObject original)
    {
        HapticObject copy = Moves.Box("Another", new Vector3(0f, 9f, 0f), new Vector3(1f, 1f, 0.1f));
        copy.enabled = false;
        Components.Private(copy, "objectId", original.ObjectId);
        copy.enabled = true;
        FeltSurface felt = BakedFeel.Find(copy.gameObject);
        return (copy.ObjectId != original.ObjectId) + " " + (felt == null ? "nothing" : felt.Material);
    }

    // A speaker beside the hand: what it plays follows the mode, stops and gains; its audio thread takes no memory.
    static void Speaker()
    {
        HapticClient client = Client(null);
        Moves.Box("Board", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f), "wood");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var speaker = new Loudspeaker();
        foreach (HeardVoice voice in new[] { HeardVoice.Sound, HeardVoice.True })
        {
            speaker.Component.Voice = voice;
            Stroke(hand, () => speaker.Play() > 0.01f, "nothing is heard");
            Components.Say("heard " + voice);
        }
        Stroke(hand, 36, () => speaker.Play()); // the new voice begins with the next touch
        Components.Say("gaps " + Silences(hand, speaker, 72));
        client.Mode = FeltMode.Service;
        Stroke(hand, Loudspeaker.EndsFrames, () => speaker.Play());
        Components.Say("while the service is felt " + Loudest(hand, speaker));
        client.Mode = FeltMode.Baked;
        Stroke(hand, () => speaker.Play() > 0.01f, "the bake is not heard again");
        client.Stop();
        Stroke(hand, Loudspeaker.EndsFrames, () => speaker.Play());
        Components.Say("after a stop " + Loudest(hand, speaker));
        speaker.Component.enabled = false;
        Player.Tick();
        speaker.Component.enabled = true;
        Components.Say("enabled after a stop " + Loudest(hand, speaker));
        hand.transform.position = new Vector3(0f, 0f, 1f);
        Components.RunFor(30);
        hand.transform.position = new Vector3(-2f, 0f, 0.06f);
        Stroke(hand, () => speaker.Play() > 0.01f, "the stop does not end");
        Object.Destroy(client.gameObject);
        Stroke(hand, Loudspeaker.EndsFrames, () => speaker.Play());
        Components.Say("without a client " + Loudest(hand, speaker));
        Components.Say("bytes of the audio thread " + speaker.Bytes + " exceptions " + Debug.Exceptions + " errors " + Debug.Errors);
    }

    static float Loudest(HapticHand hand, Loudspeaker speaker)
    {
        float loudest = 0f;
        Stroke(hand, 36, () => loudest = Math.Max(loudest, speaker.Play()));
        return loudest;
    }

    static int Silences(HapticHand hand, Loudspeaker speaker, int frames)
    {
        int silences = 0;
        Stroke(hand, frames, () => silences += speaker.Play() == 0f ? 1 : 0);
        return silences;
    }

    // Plays what the component beside its Audio Source gives: one block of the output for each frame.
    sealed class Loudspeaker
    {
        public const int EndsFrames = 8; // 0.11 s: what is rendered ahead, the fade and the delay of the sound voice
        public readonly FeltSpeaker Component;
        public long Bytes; // of managed memory that its blocks took
        readonly Action<float[], int> read;
        readonly float[] data = new float[2 * 48000 / 72];

        public Loudspeaker()
        {
            Component = new GameObject("speaker").AddComponent<FeltSpeaker>();
            MethodInfo method = typeof(FeltSpeaker).GetMethod("OnAudioFilterRead", BindingFlags.Instance | BindingFlags.NonPublic);
            read = (Action<float[], int>)Delegate.CreateDelegate(typeof(Action<float[], int>), Component, method);
            read(data, 2); // the runtime may take memory to compile what is called for the first time
        }

        // Returns the largest sample of the next block.
        public float Play()
        {
            Array.Clear(data, 0, data.Length);
            long before = GC.GetAllocatedBytesForCurrentThread();
            read(data, 2);
            Bytes += GC.GetAllocatedBytesForCurrentThread() - before;
            float largest = 0f;
            foreach (float sample in data) largest = Math.Max(largest, Math.Abs(sample));
            return largest;
        }
    }

    // Strokes at 72 frames a second until standard input ends; prints who is felt whenever it changes, and the longest time without vibration and the longest frame.
    static void Survive(string url)
    {
        HapticClient client = Components.Client(url);
        Moves.Box("Board", new Vector3(0f, 0f, 0f), new Vector3(8f, 1f, 0.1f), "wood");
        HapticHand hand = Moves.Hand(new Vector3(-2f, 0f, 0.06f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Stroke(hand, () => client.FeltBy == FeltMode.Service && client.State == LinkState.Ready && haptics.Amplitude > 0f, "the service is not felt");
        bool ends = false;
        var reader = new System.Threading.Thread(() =>
        {
            Console.In.ReadToEnd();
            ends = true;
        }) { IsBackground = true };
        reader.Start();
        double gap = 0.0, frame = 0.0, felt = Clock.Now, last = felt;
        int baked = 0, frames = 0;
        var by = FeltMode.Auto; // nobody yet
        for (; !System.Threading.Volatile.Read(ref ends); frames++)
        {
            Move(hand);
            Player.Tick();
            double now = Clock.Now;
            frame = Math.Max(frame, now - last);
            last = now;
            if (client.FeltBy == FeltMode.Baked) baked++;
            if (client.FeltBy != by) Console.WriteLine(by = client.FeltBy);
            if (Controllers.Vibrates(XRNode.RightHand)) felt = now;
            gap = Math.Max(gap, now - felt);
            System.Threading.Thread.Sleep(Math.Max(0, (int)(1e3 * (now + 1.0 / 72.0 - Clock.Now))));
        }
        Components.Say("gap_ms " + (int)(1e3 * gap) + " longest_frame_ms " + (int)(1e3 * frame) + " baked " + baked + " of " + frames + " exceptions " + Debug.Exceptions);
        Object.Destroy(client.gameObject);
    }

    public static HapticClient Client(string materials)
    {
        return Components.Made<HapticClient>("client", client =>
        {
            Components.Private(client, "mode", FeltMode.Baked);
            if (materials != null) Components.Private(client, "bakedMaterials", new TextAsset(materials));
        });
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
