using UnityEngine;

namespace HapticVLM.Samples
{
    /// <summary>
    /// Add this beside a FrameStreamer and select a hand. When the hand touches an object that the service
    /// does not know, a picture of it is sent. (The streamer's own scan does the same at the start of a scene.)
    /// </summary>
    [RequireComponent(typeof(FrameStreamer))]
    public sealed class ShowWhatIsTouched : MonoBehaviour
    {
        [SerializeField] HapticHand hand;

        FrameStreamer streamer;
        string shown;

        void Start()
        {
            streamer = GetComponent<FrameStreamer>();
            if (hand != null) return;
            Debug.LogWarning("Show What Is Touched: select a Haptic Hand in the inspector.", this);
            enabled = false;
        }

        void Update()
        {
            string touched = hand.TouchedObjectId;
            if (touched == shown) return;
            shown = touched;
            HapticObject target = HapticObject.ById(touched);
            if (target != null && (target.Material == null || target.Material == "unknown")) streamer.Capture(target);
        }
    }
}
