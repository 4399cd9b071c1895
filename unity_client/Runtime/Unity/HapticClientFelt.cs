using System;
using System.Threading;
using HapticVLM.Baked;
using HapticVLM.Wire;
using UnityEngine;
using Feel = HapticVLM.Baked.Feel;

namespace HapticVLM
{
    /// <summary>The switch between the service and the bake.</summary>
    public sealed partial class HapticClient
    {
        const string Shipped = "HapticVLM/feel.true", ShippedSound = "HapticVLM/feel.sound"; // in the package's Resources

        [SerializeField, Tooltip("Source of what is felt. Auto: the service where it answers, else the bake. Baked: nothing connects, as in a build that ships without a service.")]
        FeltMode mode = FeltMode.Auto;

        [SerializeField, Tooltip("materials.json of a bake of this scene. Empty: objects are felt as the service decided before, else as their stated material.")]
        TextAsset bakedMaterials;

        [SerializeField, Tooltip("feel.true.json of a bake of this scene. Empty: the built-in materials.")]
        TextAsset bakedFeel;

        [SerializeField, Tooltip("feel.sound.json of a bake of this scene, for a Felt Speaker. Empty: the built-in materials.")]
        TextAsset bakedSound;

        sealed class Opened
        {
            public Feel Feel, Sound; // Sound null: nothing sounds here
            public BakedScene Scene;
        }

        readonly FeltSurfaces surfaces = new FeltSurfaces();
        Felt felt;
        volatile Opened opened; // by a worker thread, not in use yet
        volatile Exception unopened;
        bool isOpening;
        HapticObject unfelt; // the object touched last, if its material is not known

        /// <summary>The source of what is felt: the service, the bake, or the service where it answers.</summary>
        public FeltMode Mode
        {
            get { return mode; }
            set
            {
                mode = value;
                FollowMode();
            }
        }

        /// <summary>Which of the two is felt now: Service or Baked.</summary>
        public FeltMode FeltBy { get { return felt == null ? FeltMode.Service : felt.By(Clock.Now); } }

        /// <summary>Whether this hand is felt: by the bake, or by the service whose outputs this scene owns.</summary>
        public bool IsFelt(HandSide hand)
        {
            return IsOwner || IsBaked(hand);
        }

        internal Felt Felt { get { return felt; } }

        internal float VibrationGain { get { return vibrationGain; } }

        /// <summary>The surfaces of the bake that is felt; null: none.</summary>
        internal BakedScene Baked { get { return surfaces.Baked; } }

        /// <summary>The reason why nothing of the bake is felt, with the remedy; null if there is none.</summary>
        internal string BakedSilence
        {
            get
            {
                if (unopened != null) return "the bake cannot be read: " + unopened.Message;
                if (felt.IsStopped) return "outputs stopped: release and touch again";
                if (vibrationGain <= 0f) return "Vibration Gain of the Haptic Client is 0";
                return unfelt == null ? null : surfaces.MissOf(unfelt);
            }
        }

        /// <summary>Feels this bake from now on; null is none.</summary>
        internal void UseBake(TextAsset materials, TextAsset feel, TextAsset sound)
        {
            bakedMaterials = materials;
            bakedFeel = feel;
            bakedSound = sound;
        }

        internal bool IsBaked(HandSide hand)
        {
            return felt != null && felt.IsBaked(hand == HandSide.Left ? HandName.Left : HandName.Right, Clock.Now);
        }

        /// <summary>Begins to follow the hands, when this client becomes the one that connects.</summary>
        void BeginFelt()
        {
            felt = new Felt(LinkNow, FormOf);
            felt.Vibrated += OnFelt;
            felt.Gain = vibrationGain;
            felt.Switch(mode, Clock.Now);
            HandGroup.Of(HandSide.Left).Touches.Touched += OnTouched;
            HandGroup.Of(HandSide.Right).Touches.Touched += OnTouched;
            if (mode != FeltMode.Service) OpenBake();
        }

        void EndFelt()
        {
            if (felt == null) return;
            HandGroup.Of(HandSide.Left).Touches.Touched -= OnTouched;
            HandGroup.Of(HandSide.Right).Touches.Touched -= OnTouched;
            felt = null;
            isOpening = false;
            opened = null;
        }

        void FollowMode()
        {
            if (felt == null || felt.Mode == mode) return;
            if (mode != FeltMode.Service) OpenBake();
            if (mode == FeltMode.Baked) Disconnect();
            felt.Switch(mode, Clock.Now);
            if (mode != FeltMode.Baked && connection == null) Connect();
        }

        /// <summary>Opens the files on a worker thread, because they take some frames; a WebGL player has none, nor a Felt Speaker.</summary>
        void OpenBake()
        {
            if (isOpening || felt.IsOpen) return;
            isOpening = true;
            unopened = null;
            string scene = TextOf(bakedMaterials), feel = TextOf(bakedFeel), sound = TextOf(bakedSound);
            string shipped = TextOf(Resources.Load<TextAsset>(Shipped)), shippedSound = TextOf(Resources.Load<TextAsset>(ShippedSound));
            if (Platform.HasThreads) ThreadPool.QueueUserWorkItem(_ => Open(scene, () => FeelOf(feel, shipped, HeardVoice.True), () => FeelOf(sound, shippedSound, HeardVoice.Sound)));
            else Open(scene, () => FeelOf(feel, shipped, HeardVoice.True), () => null);
        }

        static string TextOf(TextAsset asset)
        {
            return asset == null ? null : asset.text;
        }

        static Feel FeelOf(string baked, string shipped, HeardVoice voice)
        {
            Feel feel = Feel.Open(baked ?? shipped);
            if (feel.Voice != voice) throw new FormatException("voice: Baked Feel is feel.true.json, Baked Sound feel.sound.json");
            if (baked != null && shipped != null) feel.Complete(Feel.Open(shipped));
            return feel;
        }

        void Open(string scene, Func<Feel> feel, Func<Feel> sound)
        {
            try
            {
                opened = new Opened { Feel = feel(), Sound = sound(), Scene = scene == null ? null : BakedScene.Open(scene) };
            }
            catch (Exception error)
            {
                unopened = error;
            }
        }

        void TickFelt()
        {
            if (opened != null)
            {
                felt.Open(opened.Feel, opened.Sound);
                surfaces.Baked = opened.Scene;
                opened = null;
            }
            if (unopened != null) log.Unopened(unopened, this);
            felt.Tick(Clock.Now);
            log.FeltBy(felt.By(Clock.Now), mode, this);
        }

        void OnTouched(ref Touch touch)
        {
            FeltSurface surface = surfaces.Of(ref touch);
            bool isUnknown = touch.ObjectId != null && touch.Phase != Phase.Approach && surface.Material == null;
            unfelt = isUnknown ? HapticObject.ById(touch.ObjectId) : null;
            felt.Touch(ref touch, surface, touch.CapturedAt);
        }

        void OnFelt(Vibration vibration)
        {
            if (Vibrated != null) Vibrated(vibration);
        }

        FeltLink LinkNow()
        {
            if (connection == null) return default(FeltLink);
            return new FeltLink { IsConnected = connection.State == LinkState.Ready, IsOwner = connection.IsOwner, ReceivedAt = connection.ReceivedAt };
        }

        static FeelForm? FormOf(HandName hand)
        {
            return ControllerHaptics.FormOf(hand == HandName.Left ? HandSide.Left : HandSide.Right);
        }
    }
}
