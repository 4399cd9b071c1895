using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;
using UnityEngine.SceneManagement;

namespace HapticVLM
{
    /// <summary>
    /// The scene's connection to `hapticvlm serve`. Connects and reconnects automatically, sends every
    /// HapticObject to the service, and raises its messages as events on the main thread. The objects
    /// passed to events are reused: copy the values you store. If several clients are enabled, as in
    /// additively loaded scenes, the first connects for all; when it is disabled, the next one connects.
    /// </summary>
    [DefaultExecutionOrder(-100), DisallowMultipleComponent, AddComponentMenu("HapticVLM/Haptic Client")]
    public sealed partial class HapticClient : MonoBehaviour
    {
        [SerializeField, Tooltip("Address of the service. An address stored on this machine (ServiceAddress.Remember) overrides it.")]
        string url = "ws://127.0.0.1:8790/";

        [SerializeField, Tooltip("Required when the service runs on another machine; otherwise empty. It is saved in the scene file; prefer ServiceAddress.Remember.")]
        string token = "";

        [SerializeField, Tooltip("Keep this object when another scene is loaded: one connection for the whole game.")]
        bool keepBetweenScenes;

        [SerializeField, Tooltip("Whether the scene states its ambient temperature.")]
        bool statesAmbient = true;

        [SerializeField, Range(-60f, 80f), Tooltip("Ambient temperature, degC.")]
        float ambientC = 22f;

        [SerializeField, Tooltip("Materials that objects of this scene can have; recognition is restricted to them. Empty: all materials.")]
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
        bool isStopPending;
        bool isOverridden; // address and token set by a script, which takes precedence over stored ones
        readonly StateLog log = new StateLog();
        readonly TextureSender textures = new TextureSender();

        /// <summary>The client that connects: the first enabled one; null when there is none.</summary>
        public static HapticClient Active { get { return All.Count == 0 ? null : All[0]; } }

        /// <summary>The connection; null while disabled or paused.</summary>
        public HapticConnection Connection { get { return connection; } }

        /// <summary>The state of the link, with the remedy if it is down, as text for a person.</summary>
        public string Status
        {
            get
            {
                if (Active != this) return Waiting;
                return mode == FeltMode.Baked || !Platform.CanConnect ? "felt from the bake; nothing connects" : log.Status(connection, url);
            }
        }

        /// <summary>Whether this scene owns the outputs and is felt.</summary>
        public bool IsOwner { get { return connection != null && connection.IsOwner; } }

        public LinkState State { get { return connection == null ? LinkState.Closed : connection.State; } }

        /// <summary>Stops all outputs at once.</summary>
        public void Stop()
        {
            ControllerHaptics.SilenceAll();
            if (felt != null) felt.Stop(Clock.Now);
            if (connection == null) return;
            connection.Stop(Scope.All);
            isStopPending = IsOwner && (ControllerHaptics.FormOf(HandSide.Left) ?? ControllerHaptics.FormOf(HandSide.Right)) != null;
        }

        /// <summary>Connects to this service from now on.</summary>
        public void Connect(string toUrl, string withToken = "")
        {
            url = toUrl;
            token = withToken;
            isOverridden = true;
            Disconnect();
            if (isActiveAndEnabled && Active == this && mode != FeltMode.Baked) Connect();
        }

        /// <summary>Ends all threads at once; the editor calls this before a script reload.</summary>
        public static void AbortActive()
        {
            if (Active != null && Active.connection != null) Active.connection.Abort();
            if (Active != null) Active.textures.Retire();
            FramePipe.DisposeAll();
        }

        internal void Put(HapticObject target)
        {
            objects[target.ObjectId] = target;
            surfaces.Change(target.ObjectId);
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
            surfaces.Remove(target.ObjectId);
            if (connection == null) return;
            connection.Outbox.Scene.Remove(target.ObjectId);
            connection.Outbox.Wake();
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear(); // without a domain reload, clients of the last play session would remain
        }

        void OnEnable()
        {
            All.Add(this);
            SceneManager.sceneLoaded += OnSceneLoaded;
            if (Active == this) Begin();
            else if (!Active.keepBetweenScenes) Debug.LogWarning("HapticVLM: " + Waiting + ".", this);
        }

        void Start()
        {
            if (!keepBetweenScenes || !Application.isPlaying) return;
            transform.SetParent(null, true); // DontDestroyOnLoad needs a root object
            DontDestroyOnLoad(gameObject);
        }

        void OnDisable()
        {
            bool wasActive = Active == this;
            All.Remove(this);
            SceneManager.sceneLoaded -= OnSceneLoaded;
            Disconnect();
            EndFelt();
            if (wasActive && Active != null) Active.Begin();
        }

        string Waiting
        {
            get { return "the Haptic Client '" + Active.name + "' connects for all scenes; '" + name + "' waits until that one is disabled"; }
        }

        void OnApplicationPause(bool isPaused)
        {
            if (isPaused) Disconnect();
            else if (isActiveAndEnabled && Active == this && connection == null && mode != FeltMode.Baked) Connect();
        }

        void OnSceneLoaded(UnityEngine.SceneManagement.Scene scene, LoadSceneMode mode)
        {
            textures.Rest();
        }

        void OnValidate()
        {
            FollowMode();
            if (felt != null) felt.Gain = vibrationGain;
            if (connection != null) SendSettings();
        }

        void Update()
        {
            FramePipe.Sweep();
            if (felt == null) return;
            if (connection != null)
            {
                log.Follow(connection, url, this);
                connection.Pump();
                textures.Step(connection);
            }
            HandGroup.TickThoseWithoutFingers(connection);
            TickFelt();
        }

        /// <summary>Becomes the client that connects.</summary>
        void Begin()
        {
            BeginFelt();
            if (mode != FeltMode.Baked) Connect();
        }

        void Connect()
        {
#if !HAPTICVLM_NO_NETWORK // nothing else makes a connection, so that a build without it has no sockets
            if (!Platform.CanConnect)
            {
                Debug.LogWarning("HapticVLM: a WebGL player has no sockets and no threads, so only a bake is felt.", this);
                return;
            }
            if (!isOverridden) url = ServiceAddress.Url(url);
            Uri address = ServiceAddress.Parse(url);
            if (address == null)
            {
                Debug.LogError("HapticVLM: '" + url + "' is not an address of a service; use one like ws://127.0.0.1:8790/", this);
                return;
            }
            var settings = new ConnectionSettings { Url = address, Token = isOverridden ? token : ServiceAddress.Token(token), ClientName = Name() };
            connection = new HapticConnection(settings);
            Follow(connection.Arrivals);
            textures.Rest();
            connection.Outbox.Scene.Cut += (id, text) => log.LeftOut(id, text, this);
            log.Restart();
            SendSettings();
            objects.Clear();
            for (int i = 0; i < HapticObject.All.Count; i++) Put(HapticObject.All[i]);
            connection.Open();
#endif
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
            textures.Retire();
            OnStateChanged(LinkState.Closed);
        }

        void SendSettings()
        {
            Describe(connection.Outbox.Scene);
            connection.Outbox.SetGains(vibrationGain, thermalGain);
            RequestVibration();
        }

        /// <summary>States what holds for the whole scene.</summary>
        internal void Describe(SceneRegistry registry)
        {
            registry.SetAmbient(statesAmbient ? ambientC : (double?)null);
            registry.SetMaterials(materials);
        }

        internal void RequestVibration()
        {
            if (connection == null) return;
            connection.Outbox.SetFeel(ControllerHaptics.FormOf(HandSide.Left), ControllerHaptics.FormOf(HandSide.Right));
        }
    }
}
