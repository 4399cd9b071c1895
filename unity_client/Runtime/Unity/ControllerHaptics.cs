using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Plays the vibration of one hand on its controller. The service computes the vibration, or a bake; this
    /// component requests it and plays it frame by frame. Controllers cannot produce warmth or cold.
    /// </summary>
    [DefaultExecutionOrder(-90), AddComponentMenu("HapticVLM/Controller Haptics")]
    public sealed class ControllerHaptics : MonoBehaviour
    {
        const float FramesPerPulse = 1.5f; // so that one late frame leaves no gap
        const float TrialS = 0.3f;
        const float MaxGain = 4f;

        static readonly List<ControllerHaptics> All = new List<ControllerHaptics>();

        [SerializeField]
        HandSide hand = HandSide.Right;

        [SerializeField, Range(0f, MaxGain), Tooltip("Factor applied to the vibration; the result never exceeds the controller's maximum.")]
        float gain = 1f;

        [SerializeField, Range(0f, 0.5f), Tooltip("The weakest vibration that can be felt on this controller. Weaker values are raised above it. Measure it with Try It in play mode.")]
        float threshold;

        [SerializeField, Tooltip("Mute while the service drives a real speaker. Tick this if the same hand rests on a palm speaker.")]
        bool silentWithSpeaker;

        readonly VibrationPlan plan = new VibrationPlan();
        IHapticOutput output; // a component beside this one, else the controller's own impulses
        IHapticPlanOutput planOutput;
        ControllerWave wave; // null: the output plays no samples
        HapticClient client;
        bool isPlaying;
        bool isSpeakerFelt; // read once a frame: the thread of the connection may change it meanwhile
        float trialEndsAt;

        public HandSide Side { get { return hand == HandSide.Left ? HandSide.Left : HandSide.Right; } }

        /// <summary>Factor applied to the vibration from the service, 0 to 4; the result never exceeds the controller's maximum.</summary>
        public float Gain
        {
            get { return gain; }
            set { gain = Mathf.Min(MaxGain, Mathf.Max(0f, value)); }
        }

        /// <summary>The weakest amplitude that the user feels, 0 to 0.5; see Try.</summary>
        public float Threshold
        {
            get { return threshold; }
            set { threshold = Mathf.Min(0.5f, Mathf.Max(0f, value)); }
        }

        /// <summary>The reason why this controller is silent, with the remedy; null if it is not.</summary>
        public string Silence
        {
            get
            {
                if (client == null) return "the scene has no active Haptic Client: choose GameObject > HapticVLM > Set Up Scene";
                if (gain <= 0f) return "Gain is 0";
                if (client.State == LinkState.Ready && !client.IsOwner) return "another scene owns the outputs";
                if (client.IsBaked(Side)) return client.BakedSilence;
                if (client.State != LinkState.Ready) return client.Status;
                if (IsSpeakerFelt) return "the service plays on the speaker '" + client.Connection.Welcome.Devices.Speaker.Name
                    + "' and Silent With Speaker is ticked: untick it unless this hand rests on a palm speaker";
                return null;
            }
        }

        /// <summary>The amplitude being played, 0..1.</summary>
        public float Amplitude { get; private set; }

        /// <summary>
        /// Vibrates for 0.3 s at this amplitude, 0..1, regardless of the service. A settings menu calls it
        /// with 0.02, 0.05, 0.1 ... until the user feels it, and then stores that amplitude as Threshold.
        /// </summary>
        public void Try(float amplitude)
        {
            output.Play(Side, Mathf.Min(1f, Mathf.Max(0f, amplitude)), 0f, TrialS);
            trialEndsAt = Time.unscaledTime + TrialS;
        }

        internal void Belong(HandSide side)
        {
            hand = side;
        }

        /// <summary>The form in which to request the vibration of a hand; null if no component plays it.</summary>
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
            Request();
        }

        void OnDisable()
        {
            Rest();
            All.Remove(this);
            Request();
            Follow(null);
        }

        void Update()
        {
            if (client != HapticClient.Active) Follow(HapticClient.Active);
            if (Time.unscaledTime < trialEndsAt) return;
            bool wasSpeakerFelt = isSpeakerFelt;
            isSpeakerFelt = client != null && IsSpeakerFelt;
            if (wasSpeakerFelt && !isSpeakerFelt) plan.Silence(); // it was the speaker's: a lost link must not make it felt here
            float frame = Time.unscaledDeltaTime;
            double now = Clock.Now, hz, amplitude = plan.Strongest(now, frame, out hz);
            if (wave != null && IsWanted && PlaysWave(now, frame)) return;
            float seconds = Mathf.Min(FramesPerPulse * frame, (float)plan.RemainingS(now));
            Amplitude = IsWanted && seconds > 0f ? (float)VibrationPlan.Played(amplitude, gain, threshold) : 0f;
            if (Amplitude <= 0f) Quieten();
            else if (planOutput != null) planOutput.Play(Side, plan, now, gain, threshold);
            else output.Play(Side, Amplitude, (float)hz, seconds);
            isPlaying = Amplitude > 0f;
        }

        /// <summary>Plays samples where the output takes them and the package has the touched material; returns false where it plays the plan.</summary>
        bool PlaysWave(double now, float frame)
        {
            float largest = wave.Play(client.Felt, now, frame, gain * client.VibrationGain);
            if (!wave.IsHeard(now)) return false;
            Amplitude = largest;
            isPlaying = true;
            return true;
        }

        bool IsWanted
        {
            get { return client != null && client.IsFelt(Side) && !isSpeakerFelt; }
        }

        bool IsSpeakerFelt
        {
            get { return silentWithSpeaker && client.IsOwner && !client.Connection.Welcome.Devices.Speaker.Simulated; }
        }

        void Use(IHapticOutput next)
        {
            output = next;
            planOutput = next as IHapticPlanOutput;
            var samples = next as IHapticWaveOutput;
            wave = samples == null ? null : new ControllerWave(samples, Side, _ => IsWanted);
        }

        void Follow(HapticClient next)
        {
            if (client != null) client.Vibrated -= Take;
            client = next;
            if (client != null) client.Vibrated += Take;
        }

        void Request()
        {
            if (HapticClient.Active != null) HapticClient.Active.RequestVibration();
        }

        void Take(Vibration vibration)
        {
            if (vibration.Hand != (Side == HandSide.Left ? HandName.Left : HandName.Right)) return;
            if (vibration.Amplitude.Count > 0) plan.Take(vibration, Clock.Now);
            else if (wave == null || vibration.Stopped == true) Rest();
            else plan.Silence(); // samples fade by themselves
        }

        void Rest()
        {
            plan.Silence();
            if (wave != null) wave.Drop();
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
