using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>Message boxes shared by the inspectors of this package.</summary>
    internal static class Notes
    {
        public static void Problem(string problem)
        {
            if (problem != null) EditorGUILayout.HelpBox("Not felt: " + problem + ".", MessageType.Warning);
        }
    }

    /// <summary>An inspector that follows its component while the scene plays.</summary>
    internal abstract class LiveInspector : UnityEditor.Editor
    {
        public override bool RequiresConstantRepaint()
        {
            return Application.isPlaying;
        }
    }

    [CustomEditor(typeof(HapticClient))]
    internal sealed class HapticClientInspector : LiveInspector
    {
        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            if (!Application.isPlaying) return;
            var client = (HapticClient)target;
            bool isBaked = client.FeltBy == FeltMode.Baked;
            EditorGUILayout.LabelField("Felt from", isBaked ? "the bake" : "the service");
            EditorGUILayout.HelpBox(client.Status, client.IsOwner || isBaked ? MessageType.Info : MessageType.Warning);
        }
    }

    [CustomEditor(typeof(HapticHand)), CanEditMultipleObjects]
    internal sealed class HapticHandInspector : LiveInspector
    {
        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            var hand = (HapticHand)target;
            Notes.Problem(hand.Problem);
            if (!Application.isPlaying) return;
            HapticObject touched = HapticObject.ById(hand.TouchedObjectId);
            EditorGUILayout.LabelField("Touches", touched == null ? "nothing" : touched.name);
            EditorGUILayout.LabelField("Speed", hand.SpeedMps.ToString("F2") + " m/s");
        }
    }

    [CustomEditor(typeof(ControllerHaptics)), CanEditMultipleObjects]
    internal sealed class ControllerHapticsInspector : LiveInspector
    {
        static readonly float[] Trials = { 0.02f, 0.05f, 0.1f, 0.2f, 0.4f, 0.8f };

        float tried;

        public override void OnInspectorGUI()
        {
            DrawDefaultInspector();
            if (!Application.isPlaying) return;
            var haptics = (ControllerHaptics)target;
            EditorGUILayout.LabelField("Plays", haptics.Amplitude.ToString("F2"));
            if (haptics.Silence != null) EditorGUILayout.HelpBox("Silent: " + haptics.Silence + ".", MessageType.Warning);
            EditorGUILayout.LabelField("Try It: find the weakest pulse you can feel", EditorStyles.boldLabel);
            foreach (float amplitude in Trials)
            {
                if (!GUILayout.Button("Pulse at " + amplitude.ToString("F2"))) continue;
                tried = amplitude;
                haptics.Try(amplitude);
            }
            if (tried > 0f && GUILayout.Button("I feel " + tried.ToString("F2") + ": use it as threshold")) StoreThreshold(haptics);
        }

        /// <summary>Sets the threshold and logs it, since values set in play mode are lost when play mode ends.</summary>
        void StoreThreshold(ControllerHaptics haptics)
        {
            haptics.Threshold = tried;
            Debug.Log("HapticVLM: threshold " + haptics.Threshold.ToString("F2") + " of the " + haptics.Side.ToString().ToLowerInvariant()
                + " controller. Enter it in the inspector after play mode, or set it from your settings menu.", haptics);
        }
    }

    [CustomEditor(typeof(HapticObject)), CanEditMultipleObjects]
    internal sealed class HapticObjectInspector : UnityEditor.Editor
    {
        public override void OnInspectorGUI()
        {
            var shown = (HapticObject)target;
            serializedObject.Update();
            ShowMaterial(serializedObject.FindProperty("material"));
            DrawPropertiesExcluding(serializedObject, "m_Script", "material");
            serializedObject.ApplyModifiedProperties();
            if (targets.Length > 1) return;
            Notes.Problem(shown.Problem);
            if (shown.ScannedMaterial.Length > 0) EditorGUILayout.LabelField("Scanned", ScanRow.Describe(shown));
            if (shown.Material != null) EditorGUILayout.LabelField("Decided", shown.Material + ", by " + shown.Source + ", " + shown.Confidence.ToString("P0"));
        }

        /// <summary>Shows the material; with several objects selected, only a choice writes it, so that viewing them changes none.</summary>
        static void ShowMaterial(SerializedProperty material)
        {
            EditorGUI.showMixedValue = material.hasMultipleDifferentValues;
            string before = material.stringValue, chosen = MaterialNames.Field("Material", before);
            EditorGUI.showMixedValue = false;
            if (chosen != before) material.stringValue = chosen;
        }
    }
}
