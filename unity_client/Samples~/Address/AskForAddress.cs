using UnityEngine;

namespace HapticVLM.Samples
{
    /// <summary>
    /// Asks for the service's address on the headset's keyboard when there has been no connection for a
    /// while, and stores it on the headset. Add it to any object; a button can call Ask. The user types the
    /// address that the service prints or its dashboard shows, then a space and the token.
    /// </summary>
    public sealed class AskForAddress : MonoBehaviour
    {
        [SerializeField, Range(1f, 120f), Tooltip("Ask after this time without a connection, s.")]
        float afterS = 10f;

        TouchScreenKeyboard keyboard;
        float linkedAt;
        bool isAsked;

        /// <summary>Opens the keyboard.</summary>
        public void Ask()
        {
            isAsked = true;
            keyboard = TouchScreenKeyboard.Open(ServiceAddress.Url("ws://192.168.0.2:8790/"), TouchScreenKeyboardType.URL);
        }

        void OnEnable()
        {
            linkedAt = Time.unscaledTime;
        }

        void Update()
        {
            HapticClient client = HapticClient.Active;
            if (client == null) return;
            if (client.State == LinkState.Ready) linkedAt = Time.unscaledTime;
            if (keyboard != null) Follow(client);
            else if (!isAsked && TouchScreenKeyboard.isSupported && Time.unscaledTime > linkedAt + afterS) Ask();
        }

        void Follow(HapticClient client)
        {
            if (keyboard.status == TouchScreenKeyboard.Status.Visible) return;
            bool isDone = keyboard.status == TouchScreenKeyboard.Status.Done;
            string[] words = keyboard.text.Trim().Split(' ');
            keyboard = null;
            if (!isDone || words[0].Length == 0) return;
            string token = words.Length > 1 ? words[words.Length - 1] : "";
            ServiceAddress.Remember(words[0], token);
            client.Connect(words[0], token);
        }
    }
}
