// Approaches in a room, the influence of layers and rigs on touches, and effects without a collider.
using System;
using System.Collections.Generic;
using System.Reflection;
using System.Threading;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using Object = UnityEngine.Object;

public static class Rooms
{
    static object Inner(HapticHand hand, string property)
    {
        return typeof(HapticHand).GetProperty(property, BindingFlags.Instance | BindingFlags.NonPublic).GetValue(hand, null);
    }

    static HapticObject Mesh(string name, Vector3 at, Vector3 size, Func<Ray, float> surface)
    {
        var thing = new GameObject(name);
        thing.transform.position = at;
        var mesh = thing.AddComponent<MeshCollider>();
        mesh.bounds = new Bounds(at, size);
        mesh.SurfaceAlong = surface;
        Physics.World.Add(mesh);
        return thing.AddComponent<HapticObject>();
    }

    // The hand is within the bounds of a room and a chair, 3 cm above a table, and moves towards the table.
    static void Room()
    {
        Mesh("Room", new Vector3(0f, 1f, 0f), new Vector3(4f, 3f, 4f), ray => ray.direction.y < 0f ? ray.origin.y + 0.5f : 2f);
        Mesh("Chair", new Vector3(0f, 0.5f, 0f), new Vector3(0.6f, 1.2f, 0.6f), ray => 9f);
        Moves.Box("Table", new Vector3(0f, -0.02f, 0f), new Vector3(1f, 0.04f, 1f));
        HapticHand hand = Moves.Hand(new Vector3(0f, 0.3f, 0f));
        for (int frame = 0; frame < 40; frame++)
        {
            hand.transform.position = new Vector3(0f, 0.25f - 0.4f * frame / 72f, 0f);
            Player.Tick();
        }
        Components.Say("nears " + ((HapticObject)Inner(hand, "Near")).name + " distance " + ((double)Inner(hand, "NearM")).ToString("f3") + " closing " + ((double)Inner(hand, "ClosingMps")).ToString("f2") + " errors " + Debug.Errors);
    }

    static void Layers()
    {
        HapticObject hidden = Moves.Box("Hidden", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        HapticObject seen = Moves.Box("Seen", new Vector3(1f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        hidden.gameObject.layer = 9;
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 1f));
        Components.Private(hand, "touchableLayers", (LayerMask)(~(1 << 9)));
        string on = Touch(hand, 0f), off = Touch(hand, 1f);
        Components.Say("excluded " + (on == null) + " included " + (off == seen.ObjectId));
    }

    static string Touch(HapticHand hand, float x)
    {
        hand.transform.position = new Vector3(x, 0f, 0.11f);
        for (int i = 0; i < 5; i++) Player.Tick();
        return hand.TouchedObjectId;
    }

    // A rig walks and turns while the hand is still relative to it; then the arm swings.
    static void Bat()
    {
        var rig = new GameObject("rig");
        HapticHand hand = Moves.Hand(new Vector3(0.2f, 0f, 0f));
        hand.transform.SetParent(rig.transform, true);
        double walking = 0.0, swinging = 0.0;
        for (int frame = 0; frame < 144; frame++)
        {
            rig.transform.position = new Vector3(1.4f * frame / 72f, 0f, 0f);
            rig.transform.rotation = Quaternion.AboutY(frame);
            if (frame >= 72) hand.transform.localPosition = new Vector3(0.2f + 3f * (frame - 72) / 72f, 0f, 0f);
            Player.Tick();
            if (frame > 36 && frame < 72) walking = Math.Max(walking, (double)Inner(hand, "FreeSpeedMps"));
            if (frame > 100) swinging = Math.Max(swinging, (double)Inner(hand, "FreeSpeedMps"));
        }
        Components.Say("walking " + walking.ToString("f2") + " swinging " + swinging.ToString("f2"));
    }

    // Effects of a script, with an idle hand and on top of a touch.
    static void Effects(string url)
    {
        HapticClient client = Components.Client(url);
        HapticObject wool = Moves.Box("WoolCurtain", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        var seen = new List<string>();
        client.Decided += decision => seen.Add(decision.ObjectId == wool.ObjectId ? "curtain" : decision.ObjectId);
        int refused = 0;
        Components.Run(() => client.State == LinkState.Ready && client.IsOwner, "no welcome");
        client.Connection.Arrivals.Refused += _ => refused++;
        HapticHand left = Moves.Hand(new Vector3(0f, 0f, 1f)); // before it belongs to the left side
        left.enabled = false;
        Components.Private(left, "hand", HandSide.Left);
        left.enabled = true;
        var haptics = new GameObject("right").AddComponent<ControllerHaptics>();
        Components.Say("played " + client.Play("wood", HandGesture.Strike, HandSide.Right) + " unknown " + client.Play("wodo", HandGesture.Strike, HandSide.Right));
        float strongest = 0f;
        Func<bool> isFelt = () =>
        {
            if (!client.IsPlaying(HandSide.Right)) client.Play("wood", HandGesture.Strike, HandSide.Right); // until the service is ready
            return (strongest = Math.Max(strongest, haptics.Amplitude)) > 0.2f && seen.Contains("effect wood");
        };
        Components.Run(isFelt, "the effect is not felt", 10.0);
        double leases = 1.0;
        client.Measured += telemetry => leases = telemetry.Leases;
        Components.Run(() => !client.IsPlaying(HandSide.Right) && leases <= 0.0, "the effect does not end", 10.0);
        left.transform.position = new Vector3(0f, 0f, 0.11f);
        Components.Run(() => left.TouchedObjectId == wool.ObjectId && seen.Contains("curtain"), "no touch", 10.0);
        client.Play("glass", HandGesture.Tap, HandSide.Left);
        Components.Run(() => seen.Contains("effect glass"), "no effect on a hand that touches", 10.0);
        for (double until = Clock.Now + 0.6; Clock.Now < until; Thread.Sleep(3)) Player.Tick();
        Components.Say("still touches " + (left.TouchedObjectId == wool.ObjectId) + " leases " + leases + " refused " + refused);
        Object.Destroy(client.gameObject);
    }
}
