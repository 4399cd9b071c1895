using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Plays what one hand feels on the controller in it: the service computes the vibration, this
    /// asks for it and plays it frame by frame. No controller makes warm or cold.
    /// </summary>
    [DefaultExecutionOrder(-90), AddComponentMenu("HapticVLM/Controller Haptics")]
    public sealed class ControllerHaptics : MonoBehaviour
    {
        const float FramesAPulse = 1.5f; // so that one late frame leaves no gap

        static readonly List<ControllerHaptics> All = new List<ControllerHaptics>();

        [SerializeField]
        HandSide hand = HandSide.Right;

        [SerializeField, Range(0f, 1f), Tooltip("Times the vibration the service computes.")]
        float gain = 1f;

        [SerializeField, Tooltip("Silent while the service drives a real palm speaker, which the same hand feels.")]
        bool onlyWithoutSpeaker = true;

        readonly VibrationPlan plan = new VibrationPlan();
        IHapticOutput output;
        HapticClient client;
        bool isPlaying;

        public HandSide Side { get { return hand == HandSide.Left ? HandSide.Left : HandSide.Right; } }

        /// <summary>What plays it: a component beside this one, else the controller's own impulses.</summary>
        public IHapticOutput Output
        {
            get { return output; }
            set
            {
                Rest();
                output = value;
                Ask();
            }
        }

        /// <summary>The amplitude that is played now, 0..1.</summary>
        public float Amplitude { get; private set; }

        internal void Belong(HandSide side)
        {
            hand = side;
        }

        /// <summary>In which form a hand's vibration is asked for; null when nobody plays it.</summary>
        internal static FeelForm? FormOf(HandSide side)
        {
            FeelForm? form = null;
            for (int i = 0; i < All.Count; i++)
            {
                if (All[i].Side != side) continue;
                if (form == null || All[i].output.PlaysFrequency) form = All[i].output.PlaysFrequency ? FeelForm.Parametric : FeelForm.Amplitude;
            }
            return form;
        }

        internal static void SilenceAll()
        {
            for (int i = 0; i < All.Count; i++) All[i].Rest();
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear();
        }

        void OnEnable()
        {
            if (output == null) output = GetComponent<IHapticOutput>() ?? new XrDeviceOutput();
            All.Add(this);
            Follow(HapticClient.Active);
            Ask();
        }

        void OnDisable()
        {
            Rest();
            All.Remove(this);
            Ask();
            Follow(null);
        }

        void Update()
        {
            if (client != HapticClient.Active) Follow(HapticClient.Active);
            float frame = Time.unscaledDeltaTime;
            double now = Clock.Now, hz, amplitude = plan.Sample(now + 0.5 * frame, out hz);
            Amplitude = IsWanted ? gain * (float)amplitude : 0f;
            float seconds = Mathf.Min(FramesAPulse * frame, (float)plan.RemainingS(now));
            if (Amplitude > 0f) output.Play(Side, Amplitude, (float)hz, seconds);
            else if (isPlaying) output.Stop(Side);
            isPlaying = Amplitude > 0f;
        }

        bool IsWanted
        {
            get
            {
                if (client == null || client.State != LinkState.Ready) return false;
                return !onlyWithoutSpeaker || client.Connection.Welcome.Devices.Speaker.Simulated;
            }
        }

        void Follow(HapticClient next)
        {
            if (client != null) client.Vibrated -= Take;
            client = next;
            if (client != null) client.Vibrated += Take;
        }

        void Ask()
        {
            if (HapticClient.Active != null) HapticClient.Active.AskForVibration();
        }

        void Take(Vibration vibration)
        {
            if (vibration.Hand != (Side == HandSide.Left ? HandName.Left : HandName.Right)) return;
            if (vibration.Amplitude.Count == 0) Rest();
            else plan.Take(vibration, Clock.Now);
        }

        void Rest()
        {
            plan.Silence();
            Amplitude = 0f;
            if (isPlaying) output.Stop(Side);
            isPlaying = false;
        }
    }
}
