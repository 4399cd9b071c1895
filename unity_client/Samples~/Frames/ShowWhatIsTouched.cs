using UnityEngine;

namespace HapticVLM.Samples
{
    /// <summary>
    /// Put this beside a FrameStreamer and name a hand. When the hand touches an object that the service
    /// does not know, it is shown a picture of it. (The streamer's own scan does the same when the scene starts.)
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
            Debug.LogWarning("Show What Is Touched: name a Haptic Hand in the inspector.", this);
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
