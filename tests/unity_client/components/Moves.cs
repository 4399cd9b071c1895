// Moves hands like a headset: poses once per rendered frame, physics 50 times a second.
using System;
using System.Collections.Generic;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using Object = UnityEngine.Object;

public static class Moves
{
    const float Wall = 8f; // m long

    public static HapticHand Hand(Vector3 at, string name = "hand")
    {
        return Components.Made<HapticHand>(name, hand =>
        {
            hand.transform.position = at;
            hand.gameObject.AddComponent<Rigidbody>().isKinematic = true;
            var sphere = hand.gameObject.AddComponent<SphereCollider>();
            sphere.isTrigger = true;
            sphere.radius = 0.02f;
            Contacts.Triggers.Add(sphere);
        });
    }

    public static HapticObject Box(string name, Vector3 at, Vector3 size, string material = null)
    {
        GameObject box = GameObject.CreatePrimitive(PrimitiveType.Cube);
        box.name = name;
        box.transform.position = at;
        box.GetComponent<Collider>().bounds = new Bounds(at, size);
        box.GetComponent<Renderer>().bounds = new Bounds(at, size);
        var felt = box.AddComponent<HapticObject>();
        if (material != null) felt.State(material);
        return felt;
    }

    // A hand slides along a wall at 1 m/s: prints the least and greatest measured speed after settling.
    static void Speeds()
    {
        Box("wall", new Vector3(0f, 0f, 0f), new Vector3(Wall, 1f, 0.1f), "wood");
        foreach (int rate in new[] { 45, 60, 72, 90, 120 })
        {
            HapticHand hand = Hand(new Vector3(-2f, 0f, 0.06f));
            var seen = new List<double>();
            for (int frame = 0; frame < 2 * rate; frame++)
            {
                hand.transform.position = new Vector3(-2f + frame / (float)rate, 0f, 0.06f);
                Player.Tick(1f / rate);
                if (frame > rate / 4) seen.Add(hand.SpeedMps);
            }
            seen.Sort();
            Components.Say("rate " + rate + " touching " + (hand.TouchedObjectId != null) + " least_" + rate + " " + seen[0].ToString("r")
                + " most_" + rate + " " + seen[seen.Count - 1].ToString("r"));
            Object.Destroy(hand.gameObject);
            for (int i = 0; i < 5; i++) Player.Tick();
        }
    }

    // A rig walks at 1.4 m/s while the hand holds a mug that is part of the rig.
    static void Carry(string url)
    {
        HapticClient client = Components.Client(url);
        double level = 0.0;
        client.Measured += telemetry => level = telemetry.SpeakerLevel;
        var rig = new GameObject("rig");
        HapticObject mug = Box("mug", new Vector3(0f, 0f, 0f), new Vector3(0.1f, 0.1f, 0.1f), "metal");
        HapticHand hand = Hand(new Vector3(0.2f, 0f, 0f));
        mug.transform.SetParent(rig.transform, true);
        hand.transform.SetParent(rig.transform, true);
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        for (int frame = 0; frame < 72; frame++) Reach(hand, Math.Max(0.05f, 0.2f - 0.005f * frame));
        Components.Say("holds " + (hand.TouchedObjectId == mug.ObjectId));
        double fastest = 0.0, loudest = 0.0;
        for (int frame = 0; frame < 216; frame++)
        {
            rig.transform.position = new Vector3(1.4f * frame / 72f, 0f, 0f);
            rig.transform.rotation = Quaternion.AboutY(frame); // smooth turning, 72 degrees a second
            Frame();
            if (frame < 36) continue;
            fastest = Math.Max(fastest, hand.SpeedMps);
            loudest = Math.Max(loudest, level);
        }
        Components.Say("walking speed " + fastest.ToString("f4") + " level " + loudest.ToString("f4"));
        for (int frame = 0; frame < 72; frame++) Rub(hand, frame);
        Components.Say("rubbing level " + level.ToString("f4"));
        Components.End(client);
    }

    static void Reach(HapticHand hand, float x)
    {
        hand.transform.localPosition = new Vector3(x, 0f, 0f);
        Frame();
    }

    static void Rub(HapticHand hand, int frame)
    {
        hand.transform.localPosition = new Vector3(0.05f, 0.03f * (float)Math.Sin(0.3 * frame), 0f);
        Frame();
    }

    static void Frame()
    {
        Player.Tick();
        Thread.Sleep(14);
    }

    // Pauses the game while the hand slides.
    static void Pause(string url)
    {
        HapticClient client = Components.Client(url);
        double level = -1.0;
        client.Measured += telemetry => level = telemetry.SpeakerLevel;
        Box("wall", new Vector3(0f, 0f, 0f), new Vector3(Wall, 1f, 0.1f), "wood");
        HapticHand hand = Hand(new Vector3(-2f, 0f, 0.06f));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        double loudest = 0.0;
        for (int frame = 0; frame < 144; frame++)
        {
            hand.transform.position = new Vector3(-2f + 0.5f * frame / 72f, 0f, 0.06f);
            Frame();
            loudest = Math.Max(loudest, level);
        }
        Time.timeScale = 0f;
        for (int frame = 0; frame < 144; frame++)
        {
            hand.transform.position = new Vector3(-1f + 0.5f * frame / 72f, 0f, 0.06f);
            Frame();
        }
        Components.Say("sliding level " + loudest.ToString("f4") + " paused_level " + level.ToString("f4") + " paused_speed " + hand.SpeedMps.ToString("f4"));
        Time.timeScale = 1f;
        Components.End(client);
    }

    static void Teleport()
    {
        Box("wall", new Vector3(0f, 0f, 0f), new Vector3(Wall, 1f, 0.1f), "wood");
        HapticHand hand = Hand(new Vector3(-2f, 0f, 0.06f));
        double fastest = 0.0;
        for (int frame = 0; frame < 72; frame++)
        {
            hand.transform.position = new Vector3(frame < 36 ? -2f : 1f, 0f, 0.06f);
            Player.Tick();
            fastest = Math.Max(fastest, hand.SpeedMps);
        }
        Components.Say("touching " + (hand.TouchedObjectId != null) + " fastest " + fastest.ToString("f4"));
    }

    // Two fingers of one hand on two objects.
    static void Fingers(string url)
    {
        HapticClient client = Components.Client(url);
        var leases = new List<long>();
        client.Measured += telemetry => leases.Add(telemetry.Leases);
        HapticObject steel = Box("steel", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f), "metal");
        HapticObject wool = Box("wool", new Vector3(1f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f), "fabric");
        HapticHand first = Hand(new Vector3(0f, 0f, 0.5f), "index"), second = Hand(new Vector3(1f, 0f, 0.5f), "thumb");
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        first.transform.position = new Vector3(0f, 0f, 0.11f);
        for (int i = 0; i < 20; i++) Frame();
        second.transform.position = new Vector3(1f, 0f, 0.11f);
        for (int i = 0; i < 20; i++) Frame();
        int changes = 0;
        string target = first.TouchedObjectId;
        leases.Clear();
        for (int i = 0; i < 144; i++)
        {
            Frame();
            if (first.TouchedObjectId == target && second.TouchedObjectId == target) continue;
            changes++;
            target = first.TouchedObjectId;
        }
        Components.Say("target wool " + (target == wool.ObjectId) + " changes " + changes);
        second.transform.position = new Vector3(1f, 0f, 0.5f);
        for (int i = 0; i < 40; i++) Frame();
        Components.Say("then steel " + (first.TouchedObjectId == steel.ObjectId) + " leases_least " + Least(leases) + " reports " + leases.Count);
        first.transform.position = new Vector3(0f, 0f, 2f); // and nears nothing
        second.transform.position = new Vector3(1f, 0f, 2f);
        leases.Clear();
        Components.Run(() => leases.Contains(0), "the lease does not end", 20.0);
        Components.Say("let go " + (first.TouchedObjectId == null) + " leases_last " + leases[leases.Count - 1]);
        Components.End(client);
    }

    static long Least(List<long> values)
    {
        long least = long.MaxValue;
        foreach (long value in values) least = Math.Min(least, value);
        return least;
    }

    // Contacts at three speeds, then carving and swinging set by a script.
    static void Gestures(string url)
    {
        HapticClient client = Components.Client(url);
        string pattern = null;
        client.Decided += decision => pattern = decision.Pattern;
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        foreach (double speed in new[] { 0.05, 0.4, 1.5 })
        {
            // Each uses a new object, so that each gets its own decision.
            HapticObject oak = Box("oak" + speed, new Vector3(0f, 0f, 0f), new Vector3(0.4f, 0.4f, 0.4f), "wood");
            HapticHand hand = Hand(new Vector3(0f, 0f, 0.3f));
            Components.Private(hand, "approachM", 0f);
            pattern = null;
            for (int frame = 0; hand.TouchedObjectId == null && frame < 300; frame++)
            {
                hand.transform.position = new Vector3(0f, 0f, (float)(0.3 - speed * frame / 72.0));
                Frame();
            }
            Components.Run(() => pattern != null, "no decision");
            Components.Say("contact_at " + speed + " pattern " + pattern);
            Object.Destroy(hand.gameObject);
            Object.Destroy(oak.gameObject);
            for (int i = 0; i < 10; i++) Frame();
        }
        Carve(client, () => pattern);
        Swing(client);
        Components.End(client);
    }

    static void Carve(HapticClient client, Func<string> pattern)
    {
        HapticObject log = Box("log", new Vector3(0f, 0f, 0f), new Vector3(Wall, 1f, 0.1f), "wood");
        HapticHand knife = Hand(new Vector3(-1f, 0f, 0.06f));
        Components.Private(knife, "approachM", 0f);
        knife.Gesture = HandGesture.Carve;
        Components.Run(() => pattern() == "wood carve", "no carving");
        Components.Say("carving " + pattern());
        Object.Destroy(knife.gameObject);
        Object.Destroy(log.gameObject);
        for (int i = 0; i < 10; i++) Frame();
    }

    static void Swing(HapticClient client)
    {
        double level = 0.0;
        client.Measured += telemetry => level = Math.Max(level, telemetry.SpeakerLevel);
        HapticHand bat = Hand(new Vector3(5f, 0f, 5f));
        for (int i = 0; i < 40; i++) Frame();
        level = 0.0;
        bat.Gesture = HandGesture.Swing;
        bat.Swung = Box("bat", new Vector3(-9f, 0f, 0f), new Vector3(0.1f, 1f, 0.1f), "metal");
        for (int frame = 0; frame < 100; frame++)
        {
            bat.transform.position = new Vector3(5f + (float)Math.Sin(0.08 * frame), 0f, 5f);
            Frame();
        }
        Components.Say("swinging level " + level.ToString("f4"));
        Object.Destroy(bat.gameObject);
    }

    // A hand made of 40 capsules approaches an object.
    static void Capsules(string url)
    {
        HapticClient client = Components.Client(url);
        HapticHand hand = Hand(new Vector3(0f, 0f, 0.16f));
        for (int i = 0; i < 40; i++)
        {
            var capsule = new GameObject("capsule");
            capsule.transform.position = hand.transform.position;
            capsule.transform.SetParent(hand.transform, true);
            Physics.World.Add(capsule.AddComponent<CapsuleCollider>());
        }
        HapticObject kettle = Box("SteelKettle", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.Run(() => kettle.Material != null, "no decision on approach", 10.0);
        Components.Say("approach decides " + kettle.Material);
        kettle.gameObject.layer = 9;
        Components.End(client);
    }

    // Counts the bytes that one second of touching allocates on the main thread.
    static void TouchBytes(string url)
    {
        HapticClient client = Components.Client(url);
        Box("wall", new Vector3(0f, 0f, 0f), new Vector3(Wall, 1f, 0.1f), "wood");
        HapticHand hand = Hand(new Vector3(-2f, 0f, 0.06f));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.Run(() => Components.Private<Felt>(client, "felt").IsOpen, "no bake"); // a worker opens its tables once
        Requests requests = client.Connection.Outbox.Requests;
        long quiet = 0, quietBytes = 0, sentBytes = 0, sent = 0;
        for (int frame = 0; frame < 504; frame++)
        {
            hand.transform.position = new Vector3(-2f + 0.5f * frame / 72f, 0f, 0.06f);
            long before = requests.TouchesSent;
            Player.ResetFigures();
            Frame();
            long touches = requests.TouchesSent - before;
            if (frame < 144 || client.FeltBy != FeltMode.Service) continue; // before, or on a slow machine, the bake is felt
            sent += touches;
            quiet += touches == 0 ? 1 : 0;
            if (touches == 0) quietBytes += Player.AllocatedBytes;
            else sentBytes += Player.AllocatedBytes;
        }
        Components.Say("touching " + (hand.TouchedObjectId != null) + " quiet_frames " + quiet + " quiet_bytes " + quietBytes
            + " touches " + sent + " bytes_of_the_socket " + sentBytes / sent);
        Components.End(client);
    }
}
