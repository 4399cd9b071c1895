using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEditor;
using UnityEditor.SceneManagement;

namespace HapticVLM.Editor
{
    /// <summary>
    /// Sends pictures of every object of the open scene to the service in edit mode, and stores its
    /// decisions in the objects, to be saved with the scene: at run time no pictures are needed then.
    /// Runs in steps of the editor's update loop; never blocks.
    /// </summary>
    internal sealed class SceneScan
    {
        const int SizePx = 448;
        const int JpegQuality = 80;
        const int ViewsEach = 3;
        const double AnswerS = 3.0; // after the last picture

        readonly HapticConnection connection;
        readonly List<HapticObject> objects;
        readonly Dictionary<string, HapticObject> byId = new Dictionary<string, HapticObject>();
        readonly ObjectScanner scanner = new ObjectScanner();
        FramePipe pipe;
        CaptureCamera capture;
        double quietSince;

        public SceneScan(Uri url, string token, List<HapticObject> among)
        {
            objects = among.FindAll(shown => shown.StatedMaterial == null);
            pipe = new FramePipe(SizePx, SizePx, JpegQuality);
            capture = new CaptureCamera(pipe.Target);
            connection = new HapticConnection(new ConnectionSettings { Url = url, Token = token, ClientName = "unity scan", WantsOutputs = false });
            connection.Arrivals.Decided += OnDecided;
            foreach (HapticObject shown in objects) Register(shown);
            connection.Open();
            quietSince = Clock.Now;
        }

        /// <summary>Whether the scan is complete or was ended.</summary>
        public bool IsDone { get { return pipe == null; } }

        public int Tagged { get; private set; }

        public string Status
        {
            get
            {
                if (IsDone) return Tagged + " of " + objects.Count + " objects tagged; save the scene to keep them";
                return connection.State == LinkState.Ready ? "scanning " + objects.Count + " objects" : connection.LastError;
            }
        }

        public void Step()
        {
            if (IsDone) return;
            connection.Pump();
            if (!pipe.IsIdle) EditorApplication.QueuePlayerLoopUpdate(); // otherwise the readback may wait until the mouse moves
            if (connection.State != LinkState.Ready || !pipe.IsIdle || connection.Outbox.Frames.IsFull) return;
            scanner.Follow(connection.Session, ViewsEach);
            HapticObject shown;
            int view;
            if (!scanner.Next(objects, out shown, out view)) EndWhenQuiet();
            else Show(shown, view);
        }

        public void End()
        {
            if (IsDone) return;
            connection.Abort();
            pipe.Retire();
            capture.Destroy();
            pipe = null;
        }

        void Register(HapticObject shown)
        {
            Persisted.MakeIdUnique(shown, byId.Keys);
            byId[shown.ObjectId] = shown;
            connection.Outbox.Scene.Put(shown.Describe());
        }

        void Show(HapticObject shown, int view)
        {
            quietSince = Clock.Now;
            if (!capture.DrawAlone(shown, view, CaptureCamera.FreeLayer())) return;
            pipe.Take(new Shot { To = connection, CapturedAt = Clock.Now, ObjectId = shown.ObjectId, Region = capture.RegionOf(shown), IsAlone = true });
        }

        void EndWhenQuiet()
        {
            if (Clock.Now - quietSince > AnswerS) End();
        }

        void OnDecided(Decision decision)
        {
            HapticObject shown;
            if (decision.ObjectId == null || !byId.TryGetValue(decision.ObjectId, out shown) || shown == null) return;
            quietSince = Clock.Now;
            shown.Take(decision);
            if (decision.Source == Rung.Unknown || decision.Source == Rung.Other) return;
            if (shown.ScannedMaterial.Length == 0) Tagged++;
            Persisted.Change(shown, "Scan scene", () => shown.StoreScan(decision.Material, decision.Source.ToString(), decision.Confidence));
            EditorSceneManager.MarkSceneDirty(shown.gameObject.scene);
        }
    }
}
