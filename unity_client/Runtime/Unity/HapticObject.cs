using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>The vibration that an object makes by itself, such as a motor, a fan or a ringing phone.</summary>
    [Serializable]
    public struct HumSetting
    {
        [Range(15f, 360f), Tooltip("Fundamental, Hz.")]
        public float frequencyHz;

        [Range(0f, 1f), Tooltip("Strength of the vibration as felt in the hand; 0: not stated.")]
        public float level;

        [Tooltip("Switched off: the object does not hum, even if its name implies it.")]
        public bool off;

        internal Vibrates OnTheWire()
        {
            double hertz = Math.Min(Math.Max(frequencyHz, 15.0), Vibrates.FrequencyHzMax);
            return new Vibrates { FrequencyHz = hertz, Level = level, On = !off };
        }
    }

    /// <summary>
    /// An object that can be felt. It needs only a collider and generates its own id. Names and shader
    /// parameters of renderer and collider are sent to the service, which decides the material.
    /// </summary>
    [DisallowMultipleComponent, AddComponentMenu("HapticVLM/Haptic Object")]
    public sealed class HapticObject : MonoBehaviour
    {
        const string CopyMark = "~"; // between the id of an original and what tells its copy from it

        [SerializeField, Tooltip("Permanent id of this object for the service; generated when empty.")]
        string objectId = "";

        [SerializeField, Tooltip("Material of the object, if you know it: wood, glass, fabric, metal, ... Empty: the service decides.")]
        string material = "";

        [SerializeField, Tooltip("Whether the object has its own temperature, different from the air around it.")]
        bool statesTemperature;

        [SerializeField, Range(-100f, 400f), Tooltip("Temperature, degC.")]
        float temperatureC = 22f;

        [SerializeField, Range(0f, 10f), Tooltip("Thickness, m; 0: unknown.")]
        float thicknessM;

        [SerializeField, Tooltip("Whether the sun shines on the object, which makes it warmer than the air.")]
        Sunlight sunlight;

        [SerializeField, Tooltip("Vibration of the object itself. Level 0: as its name implies (a fridge hums), or none.")]
        HumSetting hum;

        [SerializeField, Tooltip("The object that carries this one; a hand on it feels this object's hum, attenuated.")]
        HapticObject standsOn;

        [SerializeField, HideInInspector] string scannedMaterial = "";
        [SerializeField, HideInInspector] string scannedBy = "";
        [SerializeField, HideInInspector] float scannedConfidence;

        [SerializeField, Tooltip("Send the service the names, surfaces and shader parameters of renderers and collider.")]
        bool readsAppearance = true;

        [SerializeField] DecisionEvent onDecision = new DecisionEvent();

        ObjectSurfaces surfaces; // as they were described last; null before
        int index; // in All, so that removal takes the same time in a scene of any size

        internal static readonly List<HapticObject> All = new List<HapticObject>();
        static readonly Dictionary<string, HapticObject> Ids = new Dictionary<string, HapticObject>();

        public event Action<Decision> Decided;

        public string ObjectId { get { return objectId; } }

        /// <summary>The material stated in the scene, else the one found by a scan; null if there is neither.</summary>
        public string StatedMaterial
        {
            get
            {
                if (IsChosen) return material.Trim();
                return string.IsNullOrEmpty(scannedMaterial) ? null : scannedMaterial;
            }
        }

        /// <summary>Whether a script stated the material, which therefore overrides a bake.</summary>
        internal bool IsStatedByScript { get; private set; }

        bool IsChosen { get { return !string.IsNullOrEmpty(material) && material.Trim().Length > 0; } }

        /// <summary>The material found by a scan and saved with the scene; empty if there is none.</summary>
        public string ScannedMaterial { get { return scannedMaterial; } }

        /// <summary>The evidence that decided the scan: name, encoder, ...</summary>
        public string ScannedBy { get { return scannedBy; } }

        public float ScannedConfidence { get { return scannedConfidence; } }

        /// <summary>The reason why no hand can touch it, with the remedy; null if there is none.</summary>
        public string Problem
        {
            get
            {
                return GetComponentInChildren<Collider>() != null ? null
                    : "it has no collider, so no hand can touch it: add a Box Collider or a Mesh Collider";
            }
        }

        /// <summary>The material that the service decided; null before, "unknown" if it could not decide.</summary>
        public string Material { get; private set; }

        public double Confidence { get; private set; }

        /// <summary>The evidence that weighed most in the decision.</summary>
        public Rung Source { get; private set; }

        /// <summary>Returns the enabled object with this id, or null.</summary>
        public static HapticObject ById(string id)
        {
            HapticObject match;
            return id != null && Ids.TryGetValue(id, out match) ? match : null;
        }

        /// <summary>Sets material and temperature from a script; a null or empty material leaves the decision to the service.</summary>
        public void State(string newMaterial, float? newTemperatureC = null)
        {
            material = newMaterial ?? "";
            IsStatedByScript = material.Length > 0;
            statesTemperature = newTemperatureC != null;
            temperatureC = newTemperatureC ?? temperatureC;
            if (isActiveAndEnabled && HapticClient.Active != null) HapticClient.Active.Put(this);
        }

        /// <summary>Stores or clears the result of a scan. Save the scene to keep it.</summary>
        internal void StoreScan(string foundMaterial, string by, double confidence)
        {
            scannedMaterial = foundMaterial ?? "";
            scannedBy = by ?? "";
            scannedConfidence = (float)confidence;
        }

        /// <summary>The material chosen by a person; empty leaves the decision to the scan or the service.</summary>
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
            ObjectSurfaces before = surfaces;
            surfaces = readsAppearance ? Appearance.Read(this, Application.isPlaying, ref stated) : null;
            if (before != null) before.Release(); // after the new ones were read, so that their meshes are not copied again
            if (!IsChosen && surfaces != null && surfaces.Count > 1) stated.Material = null; // a scan sees the object as a whole
            return stated;
        }

        /// <summary>Returns the surface that a hand at this position touches, as an index into the described ones; null if it is not known.</summary>
        internal int? SurfaceAt(Collider collider, Vector3 position)
        {
            return surfaces == null ? null : surfaces.At(collider, position);
        }

        /// <summary>Returns the name of the material of a surface as it was described last, or null.</summary>
        internal string SurfaceName(int surface)
        {
            return surfaces == null || surfaces.Count < 2 || surface >= surfaces.Count ? null : surfaces.MaterialOf(surface).name;
        }

        /// <summary>Returns the name of the material of a surface as it is stated, or null.</summary>
        internal string MaterialName(int surface)
        {
            return surfaces == null || surface >= surfaces.Count ? null : Appearance.NameOf(surfaces.MaterialOf(surface));
        }

        /// <summary>States the hash of this map for each surface that has it.</summary>
        internal void StateTexture(TextureMap map, SceneRegistry scene)
        {
            for (int i = 0; surfaces != null && i < surfaces.Count; i++)
            {
                if (ReferenceEquals(surfaces.MapOf(i), map)) scene.SetTexture(objectId, i, map.Hash);
            }
        }

        /// <summary>Returns the first surface with this map; -1 if there is none.</summary>
        internal int SurfaceWith(TextureMap map)
        {
            for (int i = 0; surfaces != null && i < surfaces.Count; i++)
            {
                if (ReferenceEquals(surfaces.MapOf(i), map)) return i;
            }
            return -1;
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
            index = All.Count;
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
            All[index] = last;
            last.index = index;
            All.RemoveAt(All.Count - 1);
            Ids.Remove(objectId);
            if (surfaces != null) surfaces.Release();
            surfaces = null;
        }

        /// <summary>Gives a copy a new id, which starts with the id of its original, so that a bake finds the original.</summary>
        void MakeIdUnique()
        {
            if (string.IsNullOrEmpty(objectId)) objectId = NewId();
            objectId = WireText.Within(objectId, SceneObject.ObjectIdMaxLength);
            if (!Ids.ContainsKey(objectId)) return;
            string mark = CopyMark + NewId();
            objectId = WireText.Within(objectId.Split('~')[0], SceneObject.ObjectIdMaxLength - mark.Length) + mark;
        }

        static string NewId()
        {
            return Guid.NewGuid().ToString("N");
        }
    }
}
