using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Shows the service what the scene looks like, for objects it cannot tell by name: a small mono
    /// view, never the headset's own picture. On demand by default: views of every unsure object when
    /// the scene starts, and a picture when Capture is called; or all the time.
    /// </summary>
    [DisallowMultipleComponent, AddComponentMenu("HapticVLM/Frame Streamer")]
    public sealed class FrameStreamer : MonoBehaviour
    {
        [SerializeField, Tooltip("Head or gaze camera whose pose is used; empty: this object's.")]
        Transform viewpoint;

        [SerializeField, Tooltip("Send frames all the time, not only on demand.")]
        bool isContinuous;

        [SerializeField, Range(1f, 30f)]
        float framesPerSecond = 5f;

        [SerializeField, Range(128, 1024)]
        int sizePx = 448;

        [SerializeField, Range(10, 100)]
        int jpegQuality = 80;

        [SerializeField, Tooltip("When connected, show the service each object whose material it is not sure of.")]
        bool scansObjects = true;

        [SerializeField, Range(1, 6)]
        int viewsPerObject = 3;

        [SerializeField, Range(-1, 30), Tooltip("A layer no object of the scene is on: objects are drawn there for the scan, and stay on their own. -1: the highest layer without a name.")]
        int scanLayer = -1;

        readonly ObjectScanner scanner = new ObjectScanner();
        FramePipe pipe;
        CaptureCamera capture;
        int layer;
        float dueAt;
        bool isWanted;
        HapticObject wanted;

        /// <summary>Pictures sent since this was enabled.</summary>
        public int Sent { get { return pipe == null ? 0 : pipe.Sent; } }

        /// <summary>Pictures lost to the GPU or the encoder since this was enabled.</summary>
        public int Errors { get { return pipe == null ? 0 : pipe.Errors; } }

        /// <summary>Pictures of one object on which nothing was drawn, and which were not sent.</summary>
        public int Empty { get { return pipe == null ? 0 : pipe.Empty; } }

        /// <summary>Whether all unsure objects have been shown to the service of this connection.</summary>
        public bool IsScanDone { get { return scanner.IsDone; } }

        /// <summary>Shows the service the current view; of this object, if one is named.</summary>
        public void Capture(HapticObject of = null)
        {
            isWanted = true;
            wanted = of;
        }

        void OnEnable()
        {
            isWanted = false;
            if (!Platform.CanConnect) return;
            if (!SystemInfo.supportsAsyncGPUReadback)
            {
                Debug.LogWarning("HapticVLM: this graphics API hands no pictures back: objects are told by their names. "
                    + "Scan the scene in the editor, or choose Vulkan in Player Settings.", this);
                return;
            }
            pipe = new FramePipe(sizePx, jpegQuality);
            capture = new CaptureCamera(pipe.Target);
            layer = scanLayer < 0 || scanLayer > 30 ? CaptureCamera.FreeLayer() : scanLayer;
        }

        void OnDisable()
        {
            if (pipe == null) return;
            pipe.Retire();
            pipe = null;
            capture.Destroy();
            capture = null;
        }

        void LateUpdate()
        {
            HapticConnection to = HapticClient.Active == null ? null : HapticClient.Active.Connection;
            if (pipe == null || to == null || to.State != LinkState.Ready || !pipe.IsIdle || to.Outbox.Frames.IsFull) return;
            if (scansObjects) scanner.Follow(to.Session, viewsPerObject);
            if (isWanted || (isContinuous && Time.unscaledTime >= dueAt)) TakeView(to);
            else if (scansObjects && Time.unscaledTime >= dueAt) TakeScan(to);
        }

        void TakeView(HapticConnection to)
        {
            dueAt = Time.unscaledTime + 1f / framesPerSecond;
            capture.Follow(viewpoint == null ? transform : viewpoint);
            var shot = new Shot { To = to, CapturedAt = Clock.Now };
            if (wanted != null)
            {
                shot.ObjectId = wanted.ObjectId;
                shot.Region = capture.RegionOf(wanted);
            }
            isWanted = false;
            wanted = null;
            capture.Draw();
            pipe.Take(shot);
        }

        void TakeScan(HapticConnection to)
        {
            HapticObject shown;
            int view;
            if (!scanner.Next(HapticObject.All, out shown, out view)) return;
            dueAt = Time.unscaledTime + 1f / framesPerSecond;
            if (!capture.DrawAlone(shown, view, layer)) return;
            pipe.Take(new Shot { To = to, CapturedAt = Clock.Now, ObjectId = shown.ObjectId, Region = capture.RegionOf(shown), IsAlone = true });
        }
    }
}
