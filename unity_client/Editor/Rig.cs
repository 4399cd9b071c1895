using System;
using System.Collections.Generic;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// Finds the hands of the scene: under XR Interaction Toolkit's origin, Meta's camera rig, or else
    /// the main camera. Identifies them by component name, so that none of those packages is required.
    /// </summary>
    internal sealed class Rig
    {
        static readonly string[] Types = { "XROrigin", "XRRig", "OVRCameraRig" };

        // Controllers come first, because they vibrate; {0} is replaced by the side.
        static readonly string[] Anchors = { "{0} Controller", "{0}Hand Controller", "{0}HandAnchor", "{0} Hand", "{0}Hand" };

        // The touching point of a controller in XR Interaction Toolkit, in front of the fist that holds it.
        static readonly string[] PokePoints = { "Poke Point", "Poke Interactor" };

        // Joints of XR Hands, whose names begin with L_ or R_.
        static readonly string[] Tips = { "IndexTip", "ThumbTip", "MiddleTip", "RingTip", "LittleTip" };
        const string Palm = "Palm";

        const float ControllerM = 0.02f, TipM = 0.008f, PalmM = 0.03f; // collider radii

        /// <summary>A part of the rig that touches, and the radius of its collider.</summary>
        public struct Place
        {
            public Transform Under;
            public float RadiusM;
        }

        /// <summary>The whole rig; null when there is only a camera.</summary>
        public Transform Root { get; private set; }

        /// <summary>The parent of the hands when the rig has no place for them; null when there is no camera.</summary>
        public Transform Camera { get; private set; }

        public static Rig Find()
        {
            var rig = new Rig();
            foreach (MonoBehaviour part in SceneParts.All<MonoBehaviour>())
            {
                if (part != null && Array.IndexOf(Types, part.GetType().Name) >= 0) rig.Root = part.transform;
            }
            foreach (Camera camera in SceneParts.All<Camera>())
            {
                if (rig.Camera == null || camera.CompareTag("MainCamera")) rig.Camera = camera.transform;
            }
            return rig;
        }

        /// <summary>
        /// Returns all touching parts of this hand. Rigs switch between controllers and tracked hands, so
        /// both are included; all parts of one side produce one touch. Empty if the rig has none.
        /// </summary>
        public List<Place> Places(HandSide side)
        {
            var places = new List<Place>();
            if (Root == null) return places;
            var parts = new List<Transform>();
            Root.gameObject.GetComponentsInChildren(true, parts);
            List<Place> tracked = Tracked(side, parts);
            foreach (string pattern in Anchors)
            {
                Transform anchor = parts.Find(part => part.name == string.Format(pattern, side));
                if (anchor == null || tracked.Exists(tip => SceneParts.IsUnder(tip.Under, anchor))) continue;
                places.Add(new Place { Under = PokePoint(anchor), RadiusM = ControllerM });
            }
            places.AddRange(tracked);
            return places;
        }

        static List<Place> Tracked(HandSide side, List<Transform> parts)
        {
            string prefix = side == HandSide.Left ? "L_" : "R_";
            var found = new List<Place>();
            foreach (string tip in Tips) Add(found, parts.Find(part => part.name == prefix + tip), TipM);
            Add(found, parts.Find(part => part.name == prefix + Palm), PalmM);
            return found;
        }

        static void Add(List<Place> to, Transform under, float radiusM)
        {
            if (under != null) to.Add(new Place { Under = under, RadiusM = radiusM });
        }

        static Transform PokePoint(Transform anchor)
        {
            var parts = new List<Transform>();
            anchor.gameObject.GetComponentsInChildren(true, parts);
            foreach (string name in PokePoints)
            {
                Transform found = parts.Find(part => part.name == name);
                if (found != null) return found;
            }
            return anchor;
        }
    }
}
