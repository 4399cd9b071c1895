using System;
using System.Collections.Generic;
using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>The materials offered in the editor: those a service last named, else the ones every service knows.</summary>
    internal static class MaterialNames
    {
        const string ByService = "(the service decides)";
        const string Another = "another ...";

        static readonly string[] Shipped = { "wood", "glass", "fabric", "metal", "plastic", "stone", "ceramic", "paper", "leather", "rubber", "foliage" };

        static string[] known = Shipped;

        public static void Take(List<string> named)
        {
            if (named.Count > 0) known = named.ToArray();
        }

        /// <summary>A drop-down with free text for what it does not list; returns what was chosen.</summary>
        public static string Field(string label, string material)
        {
            material = material ?? "";
            var options = new List<string> { ByService };
            options.AddRange(known);
            options.Add(Another);
            int at = material.Length == 0 ? 0 : options.IndexOf(material);
            int chosen = EditorGUILayout.Popup(label, at < 0 ? options.Count - 1 : at, options.ToArray());
            if (chosen == 0) return "";
            if (chosen < options.Count - 1) return options[chosen];
            string typed = EditorGUILayout.TextField(" ", at > 0 ? " " : material);
            return typed.Length > 0 ? typed : " "; // a space keeps the field open until something is typed
        }
    }
}
