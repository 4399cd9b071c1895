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

        [SerializeField, Range(0, 31), Tooltip("A layer nothing else uses; objects are on it only while they are scanned.")]
        int scanLayer = 31;

        readonly ObjectScanner scanner = new ObjectScanner();
        FramePipe pipe;
        Eye eye;
        float dueAt;
        bool isWanted;
        HapticObject wanted;

        /// <summary>Pictures sent since this was enabled.</summary>
        public int Sent { get { return pipe == null ? 0 : pipe.Sent; } }

        /// <summary>Pictures lost to the GPU or the encoder since this was enabled.</summary>
        public int Errors { get { return pipe == null ? 0 : pipe.Errors; } }

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
            pipe = new FramePipe(sizePx, jpegQuality);
            eye = new Eye(pipe.Target);
            isWanted = false;
        }

        void OnDisable()
        {
            pipe.Retire();
            pipe = null;
            eye.Destroy();
            eye = null;
        }

        void LateUpdate()
        {
            HapticConnection to = HapticClient.Active == null ? null : HapticClient.Active.Connection;
            if (to == null || to.State != LinkState.Ready || !pipe.IsIdle || to.Outbox.Frames.IsFull) return;
            if (scansObjects) scanner.Follow(to.Openings, viewsPerObject);
            if (isWanted || (isContinuous && Time.unscaledTime >= dueAt)) TakeView(to);
            else if (scansObjects && Time.unscaledTime >= dueAt) TakeScan(to);
        }

        void TakeView(HapticConnection to)
        {
            dueAt = Time.unscaledTime + 1f / framesPerSecond;
            eye.Follow(viewpoint == null ? transform : viewpoint);
            var shot = new Shot { To = to, CapturedAt = Clock.Now };
            if (wanted != null)
            {
                shot.ObjectId = wanted.ObjectId;
                shot.Region = eye.RegionOf(wanted);
            }
            isWanted = false;
            wanted = null;
            eye.Draw();
            pipe.Take(shot);
        }

        void TakeScan(HapticConnection to)
        {
            HapticObject one;
            int view;
            if (!scanner.Next(out one, out view)) return;
            dueAt = Time.unscaledTime + 1f / framesPerSecond;
            if (!eye.DrawAlone(one, view, scanLayer)) return;
            pipe.Take(new Shot { To = to, CapturedAt = Clock.Now, ObjectId = one.ObjectId, Region = eye.RegionOf(one), IsAlone = true });
        }
    }
}
