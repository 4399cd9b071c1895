using System.Collections.Generic;
using UnityEditor;
using UnityEditor.SceneManagement;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// GameObject > HapticVLM > Set Up Scene and Mouse Hand: add the components that a scene needs, in one step that
    /// can be undone. Existing components are unchanged, so both can be run again after the scene grew.
    /// </summary>
    internal static class SceneSetup
    {
        const string Title = "Set up HapticVLM";
        const float BesideCameraM = 0.02f;
        const float BallM = 0.08f; // seen from ten metres, as the editor's template places its camera

        [MenuItem("GameObject/HapticVLM/Set Up Scene", false, 10)]
        static void Run()
        {
            if (IsPrefabOpen()) return;
            Undo.SetCurrentGroupName(Title);
            int group = Undo.GetCurrentGroup();
            Rig rig = Rig.Find();
            var done = new List<string>();
            if (AddClient()) done.Add("a Haptic Client");
            foreach (HandSide side in new[] { HandSide.Left, HandSide.Right }) AddHand(side, rig, done);
            int objects = AddObjects(Selection.gameObjects, rig.Root);
            if (objects == 0 && Selection.gameObjects.Length > 0)
                Debug.LogWarning("HapticVLM: nothing of the selection has a collider without a Haptic Object: add a collider, or clear the selection to set up the whole scene.", null);
            if (objects > 0) done.Add(objects + (objects == 1 ? " Haptic Object" : " Haptic Objects"));
            Undo.CollapseUndoOperations(group);
            Debug.Log("HapticVLM: " + (done.Count == 0 ? "the scene is set up already" : "added " + string.Join(", ", done.ToArray()))
                + ". Start `hapticvlm serve` and press Play.", null);
        }

        [MenuItem("GameObject/HapticVLM/Mouse Hand", false, 11)]
        static void AddMouseHand()
        {
            if (IsPrefabOpen()) return;
            if (SceneParts.All<MouseHand>().Count > 0)
            {
                Debug.Log("HapticVLM: the scene has a Mouse Hand already. Press Play.", null);
                return;
            }
            GameObject ball = GameObject.CreatePrimitive(PrimitiveType.Sphere);
            ball.name = "Mouse Hand";
            Undo.RegisterCreatedObjectUndo(ball, Title);
            ball.transform.localScale = new Vector3(BallM, BallM, BallM);
            ball.GetComponent<Collider>().isTrigger = true;
            MakeKinematic(ball);
            ball.AddComponent<HapticHand>().Belong(HandSide.Right);
            ball.AddComponent<MouseHand>();
        }

        static bool IsPrefabOpen()
        {
            if (PrefabStageUtility.GetCurrentPrefabStage() == null) return false;
            Debug.LogWarning("HapticVLM: a prefab is open: close it and set up the scene.", null);
            return true;
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
            if (rig.Root == null && SceneParts.All<MouseHand>().Count > 0) return; // the mouse is this scene's only hand
            List<Rig.Place> places = rig.Places(side);
            string name = side.ToString().ToLowerInvariant();
            if (places.Count == 0 && rig.Camera == null)
            {
                Debug.LogWarning("HapticVLM: the scene has neither a rig nor a camera: add a Haptic Hand to an object that moves with the " + name + " hand.", null);
                return;
            }
            if (places.Count == 0)
            {
                GameObject beside = MakeHand(side, new Rig.Place { Under = rig.Camera, RadiusM = BesideCameraM });
                beside.transform.localPosition = new Vector3(side == HandSide.Left ? -0.2f : 0.2f, -0.15f, 0.5f);
                beside.AddComponent<ControllerHaptics>().Belong(side);
                done.Add("a " + name + " hand under '" + rig.Camera.name + "'");
                return;
            }
            for (int i = 0; i < places.Count; i++)
            {
                GameObject holder = MakeHand(side, places[i]);
                if (i == 0) holder.AddComponent<ControllerHaptics>().Belong(side); // one controller plays once
            }
            done.Add("a " + name + " hand at " + places.Count + (places.Count == 1 ? " place" : " places"));
        }

        static GameObject MakeHand(HandSide side, Rig.Place place)
        {
            var holder = new GameObject("Haptic Hand " + side);
            Undo.RegisterCreatedObjectUndo(holder, Title);
            MakeKinematic(holder);
            var sphere = holder.AddComponent<SphereCollider>();
            sphere.isTrigger = true;
            sphere.radius = place.RadiusM;
            holder.AddComponent<HapticHand>().Belong(side);
            holder.transform.SetParent(place.Under, false);
            return holder;
        }

        static void MakeKinematic(GameObject holder)
        {
            var body = holder.AddComponent<Rigidbody>();
            body.isKinematic = true;
            body.useGravity = false;
        }

        /// <summary>Adds one to each Rigidbody, or to each collider without a Rigidbody.</summary>
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
