// Prints the console messages for common errors, and checks that no data breaks the package.
using System;
using System.Reflection;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using Object = UnityEngine.Object;

public static class Reports
{
    // Runs until something is reported and for some attempts to connect more, with or without a service.
    static void States(string url)
    {
        HapticClient client = Components.Client(url);
        Components.Run(() => { lock (Debug.Lines) return Debug.Lines.Exists(line => !line.Contains("felt from the")); }, "nothing is reported");
        double until = Clock.Now + 2.5;
        while (Clock.Now < until) Components.RunFor(10);
        Components.Say("status " + client.Status);
        Components.End(client);
    }

    static void NotOwner(string url)
    {
        HapticConnection first = Owners.Other(url);
        HapticClient client = Components.Client(url);
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        Moves.Hand(new Vector3(0f, 0f, 0.11f));
        Components.RunFor(300);
        Components.Say("status " + client.Status);
        first.Close();
        Components.End(client);
    }

    static void Incomplete()
    {
        new GameObject("bare").AddComponent<HapticHand>();
        GameObject still = new GameObject("still");
        still.AddComponent<SphereCollider>().isTrigger = true;
        still.AddComponent<HapticHand>();
        GameObject solid = new GameObject("solid");
        solid.AddComponent<SphereCollider>();
        solid.AddComponent<Rigidbody>().isKinematic = true;
        solid.AddComponent<HapticHand>();
        Moves.Hand(new Vector3(0f, 0f, 0f), "whole");
        LayerMask.Named[7] = "Hands";
        Physics.IgnoreLayerCollision(7, 0);
        Moves.Hand(new Vector3(0f, 0f, 5f), "apart").gameObject.layer = 7;
        new GameObject("ghost").AddComponent<HapticObject>();
        Moves.Box("box", new Vector3(9f, 0f, 0f), new Vector3(1f, 1f, 1f));
        Components.RunFor(50);
    }

    // Truncated names, unpaired surrogates, and equally long ids.
    static void Emoji(string url)
    {
        Application.productName = new string('p', 57) + "\ud83d\ude00";
        HapticClient client = Components.Client(url);
        HapticObject odd = Moves.Box(new string('x', 255) + "\ud83d\ude00", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        Moves.Box("lone \udc00 OakTable", new Vector3(3f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 0.11f));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.Run(() => odd.Material != null, "no decision");
        Components.Say("decided " + (odd.Material != null) + " touches " + (hand.TouchedObjectId == odd.ObjectId) + " openings " + client.Connection.Openings);
        Components.End(client);
    }

    // A scene saved with the hand value Other.
    static void OtherHand(string url)
    {
        HapticClient client = Components.Client(url);
        HapticObject oak = Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 0.11f));
        hand.enabled = false;
        FieldInfo field = typeof(HapticHand).GetField("hand", BindingFlags.Instance | BindingFlags.NonPublic);
        field.SetValue(hand, Enum.ToObject(field.FieldType, 0));
        hand.enabled = true;
        hand.transform.position = new Vector3(0f, 0f, 0.5f);
        Components.RunFor(10);
        hand.transform.position = new Vector3(0f, 0f, 0.11f);
        Components.Run(() => oak.Material != null, "no decision");
        Components.Say("offered " + string.Join(" ", Enum.GetNames(field.FieldType)) + " decided " + oak.Material + " side " + hand.Side);
        Components.End(client);
    }

    // Messages that cannot be encoded, by the calling thread and by the sending thread.
    static void Unsendable(string url)
    {
        HapticClient client = Components.Client(url);
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        HapticConnection to = client.Connection;
        var none = new Touch { Phase = Phase.Slide, Hand = HandName.Other, CapturedAt = Clock.Now };
        try
        {
            to.Send(ref none);
        }
        catch (WireException error)
        {
            Components.Say("caller " + error.Message);
        }
        for (int i = 0; i < 5; i++)
        {
            var odd = new Touch { Phase = Phase.Contact, Hand = HandName.Left, Interaction = Interaction.Other, CapturedAt = Clock.Now };
            to.Outbox.Touches.Add(ref odd);
            to.Outbox.Wake(); // so that the sending thread meets it
            Components.RunFor(20);
        }
        HapticObject oak = Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        Moves.Hand(new Vector3(0f, 0f, 0.11f));
        Components.Run(() => oak.Material != null, "no decision after");
        Components.Say("still decides " + oak.Material + " openings " + to.Openings + " errors " + Debug.Errors);
        Components.End(client);
    }

    // The scene's address is wrong, and the right one is stored on the machine.
    static void Address(string url)
    {
        ServiceAddress.Remember(url, "secret");
        var client = Components.Made<HapticClient>("client", scene => Components.Private(scene, "url", "ws://127.0.0.1:9/"));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.Say("remembered token " + ServiceAddress.Token("") + " scene " + ServiceAddress.Url("ws://x/").Replace(url, "yes"));
        ServiceAddress.Remember("");
        Components.Say("forgotten " + ServiceAddress.Url("ws://x/") + " " + ServiceAddress.Token(""));
        SystemInfo.supportsAsyncGPUReadback = false;
        new GameObject("streamer").AddComponent<FrameStreamer>();
        Components.RunFor(5);
        Components.End(client);
    }

    static void WebGl(string url)
    {
        HapticClient client = Components.Client(url);
        new GameObject("streamer").AddComponent<FrameStreamer>();
        Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        Moves.Hand(new Vector3(0f, 0f, 0.11f));
        Components.RunFor(50);
        Components.Say("state " + client.State + " running " + HapticConnection.Running);
        Components.End(client);
    }
}
