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
        const float TrialS = 0.3f;
        const float MostGain = 4f;

        static readonly List<ControllerHaptics> All = new List<ControllerHaptics>();

        [SerializeField]
        HandSide hand = HandSide.Right;

        [SerializeField, Range(0f, MostGain), Tooltip("Times the vibration the service computes; never above the controller's strongest.")]
        float gain = 1f;

        [SerializeField, Range(0f, 0.5f), Tooltip("The weakest vibration that is felt on this controller. What is weaker is lifted above it. Find it with Try It, in play mode.")]
        float threshold;

        [SerializeField, Tooltip("Silent while the service drives a real speaker: tick it where the same hand rests on a palm speaker.")]
        bool silentWithSpeaker;

        readonly VibrationPlan plan = new VibrationPlan();
        IHapticOutput output;
        IHapticPlanOutput planOutput;
        HapticClient client;
        bool isPlaying;
        float triedUntil;

        public HandSide Side { get { return hand == HandSide.Left ? HandSide.Left : HandSide.Right; } }

        /// <summary>What plays it: a component beside this one, else the controller's own impulses.</summary>
        public IHapticOutput Output
        {
            get { return output; }
            set
            {
                Rest();
                Use(value ?? new XrDeviceOutput());
                Ask();
            }
        }

        /// <summary>Times the vibration the service computes, 0 to 4; never above the controller's strongest.</summary>
        public float Gain
        {
            get { return gain; }
            set { gain = Mathf.Min(MostGain, Mathf.Max(0f, value)); }
        }

        /// <summary>The weakest amplitude that its user feels, 0 to 0.5; see Try.</summary>
        public float Threshold
        {
            get { return threshold; }
            set { threshold = Mathf.Min(0.5f, Mathf.Max(0f, value)); }
        }

        /// <summary>Why nothing would be felt on this controller now, and the cure; null when all is well.</summary>
        public string Silence
        {
            get
            {
                if (client == null) return "the scene has no active Haptic Client: choose GameObject > HapticVLM > Set Up Scene";
                if (client.State != LinkState.Ready) return client.Status;
                if (!client.IsOwner) return "another scene owns the outputs";
                if (gain <= 0f) return "Gain is 0";
                if (IsSpeakerFelt) return "the service plays on the speaker '" + client.Connection.Welcome.Devices.Speaker.Name
                    + "' and Silent With Speaker is ticked: untick it unless this hand rests on a palm speaker";
                return null;
            }
        }

        /// <summary>The amplitude that is played now, 0..1.</summary>
        public float Amplitude { get; private set; }

        /// <summary>
        /// Vibrates for 0.3 s at this amplitude, 0..1, whatever the service says: what a settings menu
        /// calls with 0.02, 0.05, 0.1 ... until the user feels it, and then keeps as Threshold.
        /// </summary>
        public void Try(float amplitude)
        {
            output.Play(Side, Mathf.Min(1f, Mathf.Max(0f, amplitude)), 0f, TrialS);
            triedUntil = Time.unscaledTime + TrialS;
        }

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
            if (output == null) Use(GetComponent<IHapticOutput>() ?? new XrDeviceOutput());
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
            if (Time.unscaledTime < triedUntil) return;
            float frame = Time.unscaledDeltaTime;
            double now = Clock.Now, hz, amplitude = plan.Strongest(now, frame, out hz);
            float seconds = Mathf.Min(FramesAPulse * frame, (float)plan.RemainingS(now));
            Amplitude = IsWanted && seconds > 0f ? (float)VibrationPlan.Played(amplitude, gain, threshold) : 0f;
            if (Amplitude <= 0f) Quieten();
            else if (planOutput != null) planOutput.Play(Side, plan, now, gain, threshold);
            else output.Play(Side, Amplitude, (float)hz, seconds);
            isPlaying = Amplitude > 0f;
        }

        bool IsWanted
        {
            get { return client != null && client.IsOwner && !IsSpeakerFelt; }
        }

        bool IsSpeakerFelt
        {
            get { return silentWithSpeaker && !client.Connection.Welcome.Devices.Speaker.Simulated; }
        }

        void Use(IHapticOutput next)
        {
            output = next;
            planOutput = next as IHapticPlanOutput;
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
            Quieten();
        }

        void Quieten()
        {
            if (isPlaying) output.Stop(Side);
            isPlaying = false;
        }
    }
}
