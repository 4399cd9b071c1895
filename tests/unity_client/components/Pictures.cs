// Checks the pictures of a streamer on both kinds of graphics API, with the row order of the encoder.
using System;
using System.Collections.Generic;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

public static class Pictures
{
    // A red box above a blue one, captured as a whole view and with the region of the red box.
    static void Marker(string url)
    {
        HapticClient client = Components.Client(url);
        FrameStreamer streamer = Components.Streamer(false, false);
        HapticObject red = Painted("red", new Vector3(0f, 2f, 3f), new Color(1f, 0f, 0f, 1f));
        Painted("blue", new Vector3(0f, -2f, 3f), new Color(0f, 0f, 1f, 1f));
        Components.Run(() => client.State == LinkState.Ready, "no welcome");
        ImageConversion.Jpeg = null;
        foreach (bool startsAtTop in new[] { false, true })
        {
            SystemInfo.graphicsUVStartsAtTop = startsAtTop;
            int sent = streamer.Sent;
            streamer.Capture(red);
            Components.Run(() => streamer.Sent > sent, "no picture");
            byte[] picture = ImageConversion.Last;
            int side = (int)Math.Sqrt(picture.Length / 4);
            Region region = new MarkerFrame(client).Region;
            int row = (int)((region.Y + 0.5 * region.H) * side), column = (int)((region.X + 0.5 * region.W) * side);
            int at = 4 * (row * side + column);
            Components.Say("uv_top " + startsAtTop + " origin " + new MarkerFrame(client).Origin + " red_at_its_region " + (picture[at] > 200 && picture[at + 2] < 50)
                + " region_y " + region.Y.ToString("f3"));
        }
        Components.Say("hdr " + Camera.Last.allowHDR + " msaa " + Camera.Last.allowMSAA + " occlusion " + Camera.Last.useOcclusionCulling
            + " shadows " + Camera.ShadowsOfLast + " after " + QualitySettings.shadows);
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
    }

    // Returns the last frame in the mailbox, which stays there while the link is idle.
    sealed class MarkerFrame
    {
        public readonly Region Region;
        public readonly FrameOrigin Origin;

        public MarkerFrame(HapticClient client)
        {
            var field = typeof(FrameMailbox).GetField("sending", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic);
            Components.Run(() => !client.Connection.Outbox.Frames.IsFull, "the frame is not taken");
            var reader = new MsgPackReader(((MsgPackWriter)field.GetValue(client.Connection.Outbox.Frames)).Written);
            Frame frame = Frame.Read(ref reader, new StringPool());
            Region = frame.Region.Value;
            Origin = frame.Origin;
        }
    }

    // A scan draws an object on an unused layer, while the layers of the scene stay unchanged.
    static void Layers(string url)
    {
        HapticClient client = Components.Client(url);
        LayerMask.Named[30] = "mine";
        HapticObject painted = Painted("Xyzzy", new Vector3(0f, 0f, 2f), new Color(0f, 1f, 0f, 1f));
        painted.gameObject.layer = 5;
        painted.gameObject.AddComponent<ParticleSystemRenderer>().bounds = new Bounds(new Vector3(0f, 50f, 0f), new Vector3(9f, 9f, 9f));
        var batched = painted.GetComponent<MeshRenderer>();
        batched.isPartOfStaticBatch = true;
        batched.subMeshStartIndex = 7;
        painted.GetComponent<MeshFilter>().sharedMesh.subMeshCount = 20;
        var bone = new GameObject("arm");
        bone.transform.SetParent(painted.transform, false);
        var skinned = bone.AddComponent<SkinnedMeshRenderer>();
        skinned.sharedMesh = new Mesh();
        skinned.bounds = new Bounds(new Vector3(0f, 0f, 2f), new Vector3(0.5f, 0.5f, 0.5f));
        skinned.sharedMaterial = new Material();
        int changed = 0;
        Camera.Rendering = camera => { if (painted.gameObject.layer != 5 || bone.layer != 0) changed++; };
        FrameStreamer streamer = Components.Streamer(false, true);
        Components.Run(() => streamer.IsScanDone && streamer.Sent >= 3, "the scan does not end");
        Components.Say("layers_changed " + changed + " mask " + Camera.Last.cullingMask + " submesh " + Graphics.Submeshes.Contains(7)
            + " drawn " + Graphics.MostQueued + " far " + (Camera.Last.farClipPlane < 20f) + " exceptions " + Debug.Exceptions);
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
    }

    static void Empty(string url)
    {
        HapticClient client = Components.Client(url);
        Painted("Xyzzy", new Vector3(0f, 0f, 2f), new Color(0f, 1f, 0f, 0f)); // its shader writes no alpha
        FrameStreamer streamer = Components.Streamer(false, true);
        Components.Run(() => streamer.IsScanDone && streamer.Sent >= 3, "a picture without alpha is not sent");
        Components.Say("without alpha sent " + streamer.Sent + " empty " + streamer.Empty);
        Object.Destroy(streamer.gameObject);
        Camera.HidesAll = true;
        streamer = Components.Streamer(false, true);
        Components.Run(() => streamer.Empty >= 3, "the empty pictures are not counted");
        Components.RunFor(30);
        Components.Say("hidden sent " + streamer.Sent + " empty " + streamer.Empty);
        Camera.HidesAll = false;
        Object.Destroy(streamer.gameObject);
        Object.Destroy(client.gameObject);
    }

    // Play mode ends while a picture is still on the GPU.
    static void Retire(string url)
    {
        HapticClient client = Components.Client(url);
        FrameStreamer streamer = Components.Streamer(false, true);
        Painted("Xyzzy", new Vector3(0f, 0f, 2f), new Color(0f, 1f, 0f, 1f));
        Components.Run(() => streamer.Sent >= 1, "no picture");
        AsyncGPUReadback.LatencyFrames = 50;
        int renders = Camera.Renders;
        Components.Run(() => Camera.Renders > renders, "no second picture");
        streamer.enabled = false;
        client.enabled = false;
        Application.isPlaying = false;
        HapticClient.AbortActive();
        Components.RunFor(60);
        Components.Say("left textures " + RenderTexture.Live + " errors " + Debug.Errors + " exceptions " + Debug.Exceptions);
    }

    static HapticObject Painted(string name, Vector3 at, Color color)
    {
        HapticObject painted = Moves.Box(name, at, new Vector3(2f, 2f, 1f));
        var material = new Material();
        material.Set("_BaseColor", color);
        painted.GetComponent<Renderer>().sharedMaterial = material;
        return painted;
    }
}
