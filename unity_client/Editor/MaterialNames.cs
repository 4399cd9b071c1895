using System;
using System.Collections.Generic;
using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>The materials offered in the editor: those of the last connected service, else the built-in ones.</summary>
    internal static class MaterialNames
    {
        const string ByService = "(the service decides)";
        const string Another = "another ...";

        static readonly string[] Shipped = { "wood", "glass", "fabric", "metal", "plastic", "stone", "ceramic", "paper", "leather", "rubber", "foliage" };

        static string[] options = Options(Shipped);

        public static void Take(List<string> named)
        {
            if (named.Count > 0 && named.Count + 2 != options.Length) options = Options(named);
            for (int i = 0; i < named.Count; i++)
            {
                if (named[i] == options[i + 1]) continue;
                options = Options(named);
                return;
            }
        }

        /// <summary>A drop-down with a text field for unlisted materials; returns the chosen material.</summary>
        public static string Field(string label, string material)
        {
            material = material ?? "";
            int another = options.Length - 1;
            int at = material.Length == 0 ? 0 : Array.IndexOf(options, material);
            int chosen = EditorGUILayout.Popup(label, at < 0 ? another : at, options);
            if (chosen == 0) return "";
            if (chosen < another) return options[chosen];
            string typed = EditorGUILayout.TextField(" ", at > 0 ? " " : material);
            return typed.Length > 0 ? typed : " "; // a space keeps the field open until something is typed
        }

        static string[] Options(ICollection<string> named)
        {
            var all = new List<string> { ByService };
            all.AddRange(named);
            all.Add(Another);
            return all.ToArray();
        }
    }
}
