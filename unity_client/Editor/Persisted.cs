using System;
using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>
    /// Changes a component of the scene so that the change is saved and can be undone. A prefab instance
    /// stores only recorded differences from its prefab; without recording, the change would be lost
    /// when the scene is saved and loaded.
    /// </summary>
    internal static class Persisted
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
