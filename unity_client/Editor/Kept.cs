using System;
using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// Changes a component of the scene so that the change can be undone and is saved. An instance of
    /// a prefab keeps only what is recorded as different from its prefab: without that call the change
    /// is lost when the scene is saved and loaded.
    /// </summary>
    internal static class Kept
    {
        public static void Change(MonoBehaviour part, string title, Action change)
        {
            Undo.RecordObject(part, title);
            change();
            EditorUtility.SetDirty(part);
            PrefabUtility.RecordPrefabInstancePropertyModifications(part);
        }
    }
}
