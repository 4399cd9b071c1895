using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// The scene's connection to `hapticvlm serve`. Connects and reconnects by itself, sends the service
    /// every HapticObject, and raises its answers on the main thread. What an event carries is used
    /// again for the next one: copy what you keep. Of several, as in scenes loaded beside each other,
    /// the first connects for all; when it is gone the next one does.
    /// </summary>
    [DefaultExecutionOrder(-100), DisallowMultipleComponent, AddComponentMenu("HapticVLM/Haptic Client")]
    public sealed partial class HapticClient : MonoBehaviour
    {
        [SerializeField, Tooltip("Address of the service, unless this machine remembers another (ServiceAddress.Remember).")]
        string url = "ws://127.0.0.1:8790/";

        [SerializeField, Tooltip("Needed when the service runs on another machine; empty otherwise. It is saved in the scene file: better ServiceAddress.Remember.")]
        string token = "";

        [SerializeField, Tooltip("Stay when another scene is loaded: one connection for the whole game.")]
        bool keepBetweenScenes;

        [SerializeField, Tooltip("Whether the scene states its ambient temperature.")]
        bool statesAmbient = true;

        [SerializeField, Range(-60f, 80f), Tooltip("Ambient temperature, degC.")]
        float ambientC = 22f;

        [SerializeField, Tooltip("All that objects of this scene can be made of; pictures are taken for no other. Empty: anything.")]
        string[] materials = new string[0];

        [SerializeField, Range(0f, 1f)]
        float vibrationGain = 1f;

        [SerializeField, Range(0f, 1f)]
        float thermalGain = 1f;

        [SerializeField] DecisionEvent onDecision = new DecisionEvent();
        [SerializeField] TelemetryEvent onTelemetry = new TelemetryEvent();
        [SerializeField] LinkEvent onLinkChanged = new LinkEvent();

        static readonly List<HapticClient> All = new List<HapticClient>();

        readonly Dictionary<string, HapticObject> objects = new Dictionary<string, HapticObject>();
        HapticConnection connection;
        bool awaitsStop;
        bool isChosen; // by a script, which outranks what the machine remembers
        readonly StateLog log = new StateLog();

        /// <summary>The client that connects: the first that was enabled; null when there is none.</summary>
        public static HapticClient Active { get { return All.Count == 0 ? null : All[0]; } }

        /// <summary>The connection; null while disabled or paused.</summary>
        public HapticConnection Connection { get { return connection; } }

        /// <summary>How the link stands and what to do about it, in words for a person.</summary>
        public string Status { get { return Active == this ? log.Status(connection, url) : Waiting; } }

        /// <summary>Whether this scene is felt.</summary>
        public bool IsOwner { get { return connection != null && connection.IsOwner; } }

        public LinkState State { get { return connection == null ? LinkState.Closed : connection.State; } }

        /// <summary>Rests the outputs at once.</summary>
        public void Stop()
        {
            ControllerHaptics.SilenceAll();
            if (connection == null) return;
            connection.Stop(Scope.All);
            awaitsStop = IsOwner && (ControllerHaptics.FormOf(HandSide.Left) ?? ControllerHaptics.FormOf(HandSide.Right)) != null;
        }

        /// <summary>Uses this service from now on.</summary>
        public void Connect(string toUrl, string withToken = "")
        {
            url = toUrl;
            token = withToken;
            isChosen = true;
            Disconnect();
            if (isActiveAndEnabled && Active == this) Connect();
        }

        /// <summary>Ends the threads at once; the editor calls this before it reloads the scripts.</summary>
        public static void AbortActive()
        {
            if (Active != null && Active.connection != null) Active.connection.Abort();
            FramePipe.DisposeAll();
        }

        internal void Put(HapticObject target)
        {
            objects[target.ObjectId] = target;
            if (connection == null) return;
            UnknownMaterials.Warn(target, connection);
            connection.Outbox.Scene.Put(target.Describe());
            connection.Outbox.Wake();
        }

        internal void Remove(HapticObject target)
        {
            HapticObject known;
            if (!objects.TryGetValue(target.ObjectId, out known) || !ReferenceEquals(known, target)) return;
            objects.Remove(target.ObjectId);
            if (connection == null) return;
            connection.Outbox.Scene.Remove(target.ObjectId);
            connection.Outbox.Wake();
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear(); // without domain reload they would still be those of the last play
        }

        void OnEnable()
        {
            All.Add(this);
            if (Active == this) Connect();
            else if (!Active.keepBetweenScenes) Debug.LogWarning("HapticVLM: " + Waiting + ".", this);
        }

        void Start()
        {
            if (!keepBetweenScenes || !Application.isPlaying) return;
            transform.SetParent(null, true); // only what is at the top of a scene can be kept
            DontDestroyOnLoad(gameObject);
        }

        void OnDisable()
        {
            bool wasActive = Active == this;
            All.Remove(this);
            Disconnect();
            if (wasActive && Active != null) Active.Connect();
        }

        string Waiting
        {
            get { return "the Haptic Client '" + Active.name + "' connects for all scenes; '" + name + "' waits until it is gone"; }
        }

        void OnApplicationPause(bool isPaused)
        {
            if (isPaused) Disconnect();
            else if (isActiveAndEnabled && Active == this && connection == null) Connect();
        }

        void OnValidate()
        {
            if (connection != null) TellSettings();
        }

        void Update()
        {
            FramePipe.Sweep();
            if (connection == null) return;
            log.Follow(connection, url, this);
            connection.Pump();
            HandGroup.TickThoseWithoutFingers(connection);
        }

        void Connect()
        {
            if (!Platform.CanConnect)
            {
                Debug.LogWarning("HapticVLM: a WebGL player has no sockets and no threads: nothing is felt there.", this);
                return;
            }
            if (!isChosen) url = ServiceAddress.Url(url);
            Uri address;
            if (!Uri.TryCreate(url, UriKind.Absolute, out address) || (address.Scheme != "ws" && address.Scheme != "wss"))
            {
                Debug.LogError("HapticVLM: '" + url + "' is no address; use one like ws://127.0.0.1:8790/", this);
                return;
            }
            var settings = new ConnectionSettings { Url = address, Token = isChosen ? token : ServiceAddress.Token(token), ClientName = Name() };
            connection = new HapticConnection(settings);
            Follow(connection.Arrivals);
            log.Restart();
            TellSettings();
            objects.Clear();
            for (int i = 0; i < HapticObject.All.Count; i++) Put(HapticObject.All[i]);
            connection.Open();
        }

        static string Name()
        {
            return WireText.Within("unity " + Application.productName, Party.NameMaxLength);
        }

        void Disconnect()
        {
            if (connection == null) return;
            connection.Close();
            connection = null;
            OnStateChanged(LinkState.Closed);
        }

        void TellSettings()
        {
            connection.Outbox.Scene.SetAmbient(statesAmbient ? ambientC : (double?)null);
            connection.Outbox.Scene.SetMaterials(materials);
            connection.Outbox.SetGains(vibrationGain, thermalGain);
            AskForVibration();
        }

        internal void AskForVibration()
        {
            if (connection == null) return;
            connection.Outbox.SetFeel(ControllerHaptics.FormOf(HandSide.Left), ControllerHaptics.FormOf(HandSide.Right));
        }
    }
}
