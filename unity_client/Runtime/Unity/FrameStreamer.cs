using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Sends pictures of the scene for objects that the service cannot identify by name: a small mono
    /// view, never the headset's own picture. By default it sends views of every unsure object when the
    /// scene starts, and one picture per call of Capture. It can also stream continuously.
    /// </summary>
    [DisallowMultipleComponent, AddComponentMenu("HapticVLM/Frame Streamer")]
    public sealed class FrameStreamer : MonoBehaviour
    {
        [SerializeField, Tooltip("Head or gaze camera whose pose is used. Empty: the pose of this object.")]
        Transform viewpoint;

        [SerializeField, Tooltip("Send frames continuously, not only on demand.")]
        bool isContinuous;

        [SerializeField, Range(1f, 30f)]
        float framesPerSecond = 5f;

        [SerializeField, Range(128, 1024)]
        int sizePx = 448;

        [SerializeField, Range(10, 100)]
        int jpegQuality = 80;

        [SerializeField, Tooltip("When connected, send views of each object whose material is uncertain.")]
        bool scansObjects = true;

        [SerializeField, Range(1, 6)]
        int viewsPerObject = 3;

        [SerializeField, Range(-1, 30), Tooltip("A layer that no object of the scene uses. The scan draws objects on it; the objects keep their own layer. -1: the highest unnamed layer.")]
        int scanLayer = -1;

        readonly ObjectScanner scanner = new ObjectScanner();
        FramePipe pipe;
        CaptureCamera capture;
        int layer;
        float dueAt;
        bool isCaptureRequested;
        HapticObject captureTarget;

        /// <summary>Number of pictures sent since this component was enabled.</summary>
        public int Sent { get { return pipe == null ? 0 : pipe.Sent; } }

        /// <summary>Number of pictures lost to errors of the GPU or the encoder since this component was enabled.</summary>
        public int Errors { get { return pipe == null ? 0 : pipe.Errors; } }

        /// <summary>Number of pictures of a single object that were empty and therefore not sent.</summary>
        public int Empty { get { return pipe == null ? 0 : pipe.Empty; } }

        /// <summary>Whether the service of this connection has been shown all unsure objects.</summary>
        public bool IsScanDone { get { return scanner.IsDone; } }

        /// <summary>Sends one picture of the current view, with the region of this object if one is given.</summary>
        public void Capture(HapticObject of = null)
        {
            isCaptureRequested = true;
            captureTarget = of;
        }

        void OnEnable()
        {
            isCaptureRequested = false;
            if (!Platform.CanConnect) return;
            if (!SystemInfo.supportsAsyncGPUReadback)
            {
                Debug.LogWarning("HapticVLM: this graphics API does not support readback, so objects are identified by name only. "
                    + "Scan the scene in the editor, or choose Vulkan in Player Settings.", this);
                return;
            }
            pipe = new FramePipe(sizePx, sizePx, jpegQuality);
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
            if (isCaptureRequested || (isContinuous && Time.unscaledTime >= dueAt)) TakeView(to);
            else if (scansObjects && Time.unscaledTime >= dueAt) TakeScan(to);
        }

        void TakeView(HapticConnection to)
        {
            dueAt = Time.unscaledTime + 1f / framesPerSecond;
            capture.Follow(viewpoint == null ? transform : viewpoint);
            var shot = new Shot { To = to, CapturedAt = Clock.Now };
            if (captureTarget != null)
            {
                shot.ObjectId = captureTarget.ObjectId;
                shot.Region = capture.RegionOf(captureTarget);
            }
            isCaptureRequested = false;
            captureTarget = null;
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
