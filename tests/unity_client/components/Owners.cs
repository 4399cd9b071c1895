// Ownership of the outputs: scenes that change, wait, take over, and return after a pause.
using System;
using System.Threading;
using HapticVLM;
using HapticVLM.Editor;
using HapticVLM.Wire;
using UnityEditor;
using UnityEngine;
using Object = UnityEngine.Object;

public static class Owners
{
    public static HapticConnection Other(string url)
    {
        var other = new HapticConnection(new ConnectionSettings { Url = new Uri(url), ClientName = "other" });
        other.Open();
        while (other.State != LinkState.Ready) Thread.Sleep(5);
        return other;
    }

    static void Touch(HapticConnection with)
    {
        var touch = new Touch { Phase = Phase.Contact, Hand = HandName.Left, ObjectId = "x", CapturedAt = Clock.Now };
        with.Send(ref touch);
    }

    // Another scene owns and uses the outputs, then disconnects.
    static void Handover(string url)
    {
        HapticConnection other = Other(url);
        Touch(other);
        HapticClient client = Components.Client(url);
        Requests requests = client.Connection.Outbox.Requests;
        HapticObject oak = Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 0.11f));
        var haptics = hand.gameObject.AddComponent<ControllerHaptics>();
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.RunFor(100);
        Components.Say("waiting: owner " + client.IsOwner + " touches sent " + requests.TouchesSent + " silent because " + haptics.Silence);
        client.Stop(); // the service reports it to the owner, which this is not
        Components.RunFor(20);
        other.Close();
        Components.Run(() => client.IsOwner, "the outputs are not taken", 10.0);
        hand.transform.position = new Vector3(0f, 0f, 0.5f); // a stop lasts until the hand releases
        Components.RunFor(20);
        Components.Run(() => Vibrates(hand, haptics) && oak.Material != null, "nothing is felt", 10.0);
        Components.Say("felt as " + oak.Material);
        Object.Destroy(client.gameObject);
    }

    static bool Vibrates(HapticHand hand, ControllerHaptics haptics)
    {
        hand.transform.position = new Vector3(0.05f * (float)Math.Sin(6.0 * Clock.Now), 0f, 0.11f);
        return haptics.Amplitude > 0.1f;
    }

    // Like SceneManager.LoadScene: the old client ends and the new one starts in the same frame.
    static void SceneChanges(string url)
    {
        const int Times = 100;
        int atOnce = 0, owned = 0;
        for (int i = 0; i < Times; i++)
        {
            HapticClient client = Components.Client(url);
            Components.Run(() => client.State == LinkState.Ready, "no welcome in scene " + i);
            atOnce += client.IsOwner ? 1 : 0;
            Components.Run(() => client.IsOwner, "scene " + i + " does not own the outputs", 20.0);
            owned++;
            Object.Destroy(client.gameObject);
        }
        Components.Say("scenes " + Times + " owned " + owned + " at once " + atOnce);
    }

    static void TwoClients(string url)
    {
        HapticClient first = Components.Client(url), second = Components.Client(url);
        Components.Run(() => first.State == LinkState.Ready && first.IsOwner, "no welcome");
        Components.Say("first active " + (HapticClient.Active == first) + " second " + second.State + ": " + second.Status);
        Object.Destroy(first.gameObject);
        Components.Run(() => second.State == LinkState.Ready && second.IsOwner, "the second does not take over", 20.0);
        Components.Say("then second active " + (HapticClient.Active == second));
        Object.Destroy(second.gameObject);
        Components.Say("then none " + (HapticClient.Active == null));
    }

    static void Kept(string url)
    {
        var kept = Components.Made<HapticClient>("kept", client =>
        {
            Components.Private(client, "keepBetweenScenes", true);
            client.Connect(url);
        });
        Components.RunFor(2);
        HapticClient next = Components.Client(url);
        Components.Say("kept " + Object.KeptAcrossScenes.Contains(kept.gameObject) + " of next " + (HapticClient.Active == kept) + " " + next.State + " warnings " + Components.Warnings());
        Object.Destroy(next.gameObject);
        Object.Destroy(kept.gameObject);
    }

    // The headset is taken off and put on: a new session, in which the service knows no pictures.
    static void HeadsetOff(string url)
    {
        HapticClient client = Components.Client(url);
        Components.Thing("Xyzzy");
        var streamer = Components.Streamer(false, true);
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        Components.Run(() => streamer.IsScanDone && streamer.Sent > 0, "the scan does not end");
        int before = streamer.Sent;
        Player.Send(client.gameObject, "OnApplicationPause", true);
        Components.RunFor(5);
        Player.Send(client.gameObject, "OnApplicationPause", false);
        Components.Run(() => client.State == LinkState.Ready, "it does not resume");
        Components.Run(() => streamer.Sent > before, "no picture is shown to the new session", 10.0);
        Components.Say("shown before " + (before > 0) + " and after " + (streamer.Sent > before));
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
    }

    // A stop, then a new session, whose first touch is felt.
    static void Stopped(string url)
    {
        HapticConnection first = Other(url);
        first.Stop(Scope.All);
        Thread.Sleep(200);
        first.Close();
        HapticClient client = Components.Client(url);
        int refused = 0;
        client.Connection.Arrivals.Refused += _ => refused++;
        HapticObject oak = Moves.Box("OakTable", new Vector3(0f, 0f, 0f), new Vector3(0.2f, 0.2f, 0.2f));
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 1f));
        Components.Run(() => client.State == LinkState.Ready && client.IsOwner, "no welcome");
        Components.RunFor(50);
        hand.transform.position = new Vector3(0f, 0f, 0.11f);
        Components.Run(() => oak.Material != null, "no decision");
        Components.RunFor(50);
        Components.Say("touches " + (hand.TouchedObjectId == oak.ObjectId) + " refused " + refused);
        Object.Destroy(client.gameObject);
    }

    static void PlayDuringScan(string url)
    {
        Application.isPlaying = false;
        for (int i = 0; i < 40; i++) Components.Thing("Xyzzy" + i);
        var window = EditorWindow.GetWindow<HapticWindow>("HapticVLM");
        Components.Private(window, "url", url);
        EditorParts.Call(window, "OnEnable");
        GUILayout.Pressed = "Scan scene";
        EditorParts.Call(window, "OnGUI");
        double until = Clock.Now + 20.0;
        while (!EditorParts.Shows(window, "scanning") && Clock.Now < until) Thread.Sleep(3);
        HapticConnection beside = Other(url); // as a player beside the editor
        Components.Run(() => beside.IsOwner, "a scene beside the scan is not felt", 10.0);
        Components.Say("felt beside the scan " + !EditorParts.Shows(window, "objects tagged"));
        beside.Close();
        EditorApplication.Change(PlayModeStateChange.ExitingEditMode);
        Components.Say("scan ended " + EditorParts.Shows(window, "objects tagged"));
        Application.isPlaying = true;
        HapticClient client = Components.Client(url);
        Components.Run(() => client.State == LinkState.Ready && client.IsOwner, "the scene that plays is not felt", 10.0);
        Components.Say("felt while it plays");
        Object.Destroy(client.gameObject);
        EditorParts.Call(window, "OnDisable");
    }
}
