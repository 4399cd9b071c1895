using System.Collections.Generic;
using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// GameObject > HapticVLM > Set Up Scene: all a scene needs to be felt, in one step that can be
    /// undone. What is there already stays as it is, so it may be chosen again after the scene grew.
    /// </summary>
    internal static class SceneSetup
    {
        const string Title = "Set up HapticVLM";
        const float RadiusM = 0.02f;

        [MenuItem("GameObject/HapticVLM/Set Up Scene", false, 10)]
        static void Run()
        {
            Undo.SetCurrentGroupName(Title);
            int group = Undo.GetCurrentGroup();
            Rig rig = Rig.Find();
            var done = new List<string>();
            if (AddClient()) done.Add("a Haptic Client");
            foreach (HandSide side in new[] { HandSide.Left, HandSide.Right }) AddHand(side, rig, done);
            int objects = AddObjects(Selection.gameObjects, rig.Root);
            if (objects > 0) done.Add(objects + (objects == 1 ? " Haptic Object" : " Haptic Objects"));
            Undo.CollapseUndoOperations(group);
            Debug.Log("HapticVLM: " + (done.Count == 0 ? "the scene is set up already" : "added " + string.Join(", ", done.ToArray()))
                + ". Start `hapticvlm serve` and press Play.", null);
        }

        static bool AddClient()
        {
            if (SceneParts.All<HapticClient>().Count > 0) return false;
            var holder = new GameObject("Haptic Client");
            Undo.RegisterCreatedObjectUndo(holder, Title);
            holder.AddComponent<HapticClient>();
            return true;
        }

        static void AddHand(HandSide side, Rig rig, List<string> done)
        {
            if (SceneParts.All<HapticHand>().Exists(hand => hand.Side == side)) return;
            Transform anchor = rig.Anchor(side);
            Transform under = anchor != null ? anchor : rig.Camera;
            if (under == null)
            {
                Debug.LogWarning("HapticVLM: the scene has neither a rig nor a camera: put a Haptic Hand on whatever moves as the "
                    + side + " hand does.", null);
                return;
            }
            GameObject holder = MakeHand(side);
            holder.transform.SetParent(under, false);
            if (anchor == null) holder.transform.localPosition = new Vector3(side == HandSide.Left ? -0.2f : 0.2f, -0.15f, 0.5f);
            done.Add("a " + side.ToString().ToLowerInvariant() + " hand under '" + under.name + "'");
        }

        static GameObject MakeHand(HandSide side)
        {
            var holder = new GameObject("Haptic Hand " + side);
            Undo.RegisterCreatedObjectUndo(holder, Title);
            var body = holder.AddComponent<Rigidbody>();
            body.isKinematic = true;
            body.useGravity = false;
            var sphere = holder.AddComponent<SphereCollider>();
            sphere.isTrigger = true;
            sphere.radius = RadiusM;
            holder.AddComponent<HapticHand>().Belong(side);
            holder.AddComponent<ControllerHaptics>().Belong(side);
            return holder;
        }

        /// <summary>One for each body, or for each collider without a body.</summary>
        static int AddObjects(GameObject[] selected, Transform rig)
        {
            int added = 0;
            foreach (Collider collider in SceneParts.Touchable(selected, rig))
            {
                Rigidbody body = collider.attachedRigidbody;
                GameObject holder = body != null ? body.gameObject : collider.gameObject;
                if (holder.GetComponentInParent<HapticObject>() != null) continue;
                Undo.AddComponent<HapticObject>(holder);
                added++;
            }
            return added;
        }
    }
}
