using System.Collections.Generic;
using UnityEngine;
using UnityEngine.SceneManagement;

namespace HapticVLM.Editor
{
    /// <summary>Finds components in all open scenes, without engine searches whose names differ between versions.</summary>
    internal static class SceneParts
    {
        public static List<T> All<T>()
        {
            var found = new List<T>();
            var some = new List<T>();
            for (int i = 0; i < SceneManager.sceneCount; i++)
            {
                Scene scene = SceneManager.GetSceneAt(i);
                if (!scene.isLoaded) continue;
                foreach (GameObject root in scene.GetRootGameObjects())
                {
                    root.GetComponentsInChildren(true, some);
                    found.AddRange(some);
                }
            }
            return found;
        }

        /// <summary>Returns the colliders that a hand can feel, in the selected objects or else in the whole scene.</summary>
        public static List<Collider> Touchable(GameObject[] selected, Transform rig)
        {
            var all = new List<Collider>();
            var some = new List<Collider>();
            foreach (GameObject chosen in selected)
            {
                chosen.GetComponentsInChildren(true, some);
                all.AddRange(some);
            }
            if (selected.Length == 0) all = All<Collider>();
            all.RemoveAll(collider => collider.isTrigger || !collider.gameObject.activeInHierarchy || collider is CharacterController || IsUnder(collider.transform, rig)
                || collider.GetComponentInParent<HapticHand>() != null);
            return all;
        }

        public static bool IsUnder(Transform part, Transform whole)
        {
            if (whole == null) return false;
            for (Transform at = part; at != null; at = at.parent)
            {
                if (at == whole) return true;
            }
            return false;
        }
    }
}
