using System;
using System.Collections.Generic;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// Where the hands of the scene are: under XR Interaction Toolkit's origin, Meta's camera rig, or
    /// else the main camera. Known by the names of components, so that no package is needed.
    /// </summary>
    internal sealed class Rig
    {
        static readonly string[] Types = { "XROrigin", "XRRig", "OVRCameraRig" };

        // Best first; the hand's name takes the place of {0}.
        static readonly string[] Anchors = { "{0} Controller", "{0}Hand Controller", "{0}HandAnchor", "{0} Hand", "{0}Hand" };

        /// <summary>The whole rig; null when there is only a camera.</summary>
        public Transform Root { get; private set; }

        /// <summary>What the hands go under when the rig has no place for them; null when there is no camera.</summary>
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

        /// <summary>What moves with this hand; null when the rig has nothing of such a name.</summary>
        public Transform Anchor(HandSide side)
        {
            if (Root == null) return null;
            var parts = new List<Transform>();
            Root.gameObject.GetComponentsInChildren(true, parts);
            foreach (string pattern in Anchors)
            {
                string wanted = string.Format(pattern, side);
                Transform found = parts.Find(part => part.name == wanted);
                if (found != null) return found;
            }
            return null;
        }
    }
}
