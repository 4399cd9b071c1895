using System;
using System.Collections.Generic;
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

        /// <summary>Gives an object without an id, or a duplicate with that of its original, an id of its own.</summary>
        public static void MakeIdUnique(HapticObject shown, ICollection<string> taken)
        {
            if (string.IsNullOrEmpty(shown.ObjectId) || taken.Contains(shown.ObjectId)) Change(shown, "Renew id", shown.RenewId);
        }
    }
}
