using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>How an object vibrates by itself: a motor, a fan, a phone that rings.</summary>
    [Serializable]
    public struct HumSetting
    {
        [Range(15f, 360f), Tooltip("Fundamental, Hz.")]
        public float frequencyHz;

        [Range(0f, 1f), Tooltip("How strongly it is felt in the hand; 0: the scene does not say.")]
        public float level;

        [Tooltip("Switched off: it does not hum whatever its name says.")]
        public bool off;

        internal Vibrates OnTheWire()
        {
            double hertz = Math.Min(Math.Max(frequencyHz, 15.0), Vibrates.FrequencyHzMax);
            return new Vibrates { FrequencyHz = hertz, Level = level, On = !off };
        }
    }

    /// <summary>
    /// An object that can be felt. Needs nothing but a collider; its id it makes up itself. Names and
    /// shader parameters of renderer and collider go to the service, which decides what it is made of.
    /// </summary>
    [DisallowMultipleComponent, AddComponentMenu("HapticVLM/Haptic Object")]
    public sealed class HapticObject : MonoBehaviour
    {
        [SerializeField, Tooltip("Stable name of this object on the wire; made up when empty.")]
        string objectId = "";

        [SerializeField, Tooltip("What it is made of, if you know: wood, glass, fabric, metal, ... Empty: the service decides.")]
        string material = "";

        [SerializeField, Tooltip("Whether the object has a temperature of its own, unlike the air around it.")]
        bool statesTemperature;

        [SerializeField, Range(-100f, 400f), Tooltip("Temperature, degC.")]
        float temperatureC = 22f;

        [SerializeField, Range(0f, 10f), Tooltip("Thickness, m; 0: unknown.")]
        float thicknessM;

        [SerializeField, Tooltip("Whether the sun shines on it, which makes it warmer than the air.")]
        Sunlight sunlight;

        [SerializeField, Tooltip("How it vibrates by itself; level 0: as its name says (a fridge hums), or not at all.")]
        HumSetting hum;

        [SerializeField, Tooltip("What carries it, so that a hand there feels it hum, weaker.")]
        HapticObject standsOn;

        [SerializeField, HideInInspector] string scannedMaterial = "";
        [SerializeField, HideInInspector] string scannedBy = "";
        [SerializeField, HideInInspector] float scannedConfidence;

        [SerializeField, Tooltip("Send the service the names and shader parameters of renderer and collider.")]
        bool readsAppearance = true;

        [SerializeField] DecisionEvent onDecision = new DecisionEvent();

        int place; // in All, so that leaving it costs the same in a scene of any size

        internal static readonly List<HapticObject> All = new List<HapticObject>();
        static readonly Dictionary<string, HapticObject> Ids = new Dictionary<string, HapticObject>();

        public event Action<Decision> Decided;

        public string ObjectId { get { return objectId; } }

        /// <summary>What the scene states, else what a scan of the scene found; or null.</summary>
        public string StatedMaterial
        {
            get
            {
                if (!string.IsNullOrEmpty(material) && material.Trim().Length > 0) return material.Trim();
                return string.IsNullOrEmpty(scannedMaterial) ? null : scannedMaterial;
            }
        }

        /// <summary>What a scan found, saved with the scene; empty when none did.</summary>
        public string ScannedMaterial { get { return scannedMaterial; } }

        /// <summary>By what a scan decided: name, encoder, ...</summary>
        public string ScannedBy { get { return scannedBy; } }

        public float ScannedConfidence { get { return scannedConfidence; } }

        /// <summary>Why no hand can touch it, and the cure; null when all is well.</summary>
        public string Problem
        {
            get
            {
                return GetComponentInChildren<Collider>() != null ? null
                    : "it has no collider, so no hand can touch it: add a Box Collider or a Mesh Collider";
            }
        }

        /// <summary>What the service decided: null before, "unknown" when it could not tell.</summary>
        public string Material { get; private set; }

        public double Confidence { get; private set; }

        /// <summary>What weighed most in the decision.</summary>
        public Rung Source { get; private set; }

        /// <summary>The enabled object of this id, or null.</summary>
        public static HapticObject ById(string id)
        {
            HapticObject found;
            return id != null && Ids.TryGetValue(id, out found) ? found : null;
        }

        /// <summary>States the material from a script; null or empty leaves it to the service.</summary>
        public void State(string newMaterial, float? newTemperatureC = null)
        {
            material = newMaterial ?? "";
            statesTemperature = newTemperatureC != null;
            temperatureC = newTemperatureC ?? temperatureC;
            if (isActiveAndEnabled && HapticClient.Active != null) HapticClient.Active.Put(this);
        }

        /// <summary>Keeps what a scan found, or forgets it; the scene must be saved to keep it.</summary>
        internal void KeepScan(string found, string by, double confidence)
        {
            scannedMaterial = found ?? "";
            scannedBy = by ?? "";
            scannedConfidence = (float)confidence;
        }

        /// <summary>What a person chose as its material; empty leaves it to the scan or the service.</summary>
        internal string ChosenMaterial
        {
            get { return material; }
            set { material = value; }
        }

        internal void RenewId()
        {
            objectId = NewId();
        }

        internal SceneObject Describe()
        {
            var stated = new SceneObject
            {
                ObjectId = objectId,
                Material = StatedMaterial,
                TemperatureC = statesTemperature ? temperatureC : (double?)null,
                ThicknessM = thicknessM > 0f ? thicknessM : (double?)null,
                Sunlit = sunlight == Sunlight.Unknown ? (bool?)null : sunlight == Sunlight.InTheSun,
                Vibrates = hum.level > 0f ? hum.OnTheWire() : (Vibrates?)null,
                StandsOn = standsOn != null ? new List<string> { standsOn.ObjectId } : null,
            };
            if (readsAppearance) Appearance.Read(gameObject, ref stated);
            return stated;
        }

        internal void Take(Decision decision)
        {
            Material = decision.Material;
            Confidence = decision.Confidence;
            Source = decision.Source;
            if (Decided != null) Decided(decision);
            onDecision.Invoke(decision);
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear();
            Ids.Clear();
        }

        void Reset()
        {
            objectId = NewId();
        }

        void OnEnable()
        {
            MakeIdUnique();
            Ids[objectId] = this;
            place = All.Count;
            All.Add(this);
            if (HapticClient.Active != null) HapticClient.Active.Put(this);
        }

        void Start()
        {
            string problem = Problem;
            if (problem != null) Debug.LogWarning("HapticVLM: the Haptic Object '" + name + "' cannot be felt: " + problem + ".", this);
        }

        void OnDisable()
        {
            if (HapticClient.Active != null) HapticClient.Active.Remove(this);
            HapticObject last = All[All.Count - 1];
            All[place] = last;
            last.place = place;
            All.RemoveAt(All.Count - 1);
            Ids.Remove(objectId);
        }

        /// <summary>A copy of a prefab or of an object starts with the id of its original.</summary>
        void MakeIdUnique()
        {
            if (string.IsNullOrEmpty(objectId)) objectId = NewId();
            objectId = WireText.Within(objectId, SceneObject.ObjectIdMaxLength);
            if (Ids.ContainsKey(objectId)) objectId = NewId();
        }

        static string NewId()
        {
            return Guid.NewGuid().ToString("N");
        }
    }
}
