using System;
using UnityEditor;
using UnityEngine;

namespace HapticVLM.Editor
{
    /// <summary>A list that draws only its visible rows, because it is drawn many times a second in scenes of any size.</summary>
    internal static class VisibleRows
    {
        const float RowHeight = 20f; // a popup and its margin

        /// <summary>Draws the rows in sight, each by its index; returns how far the list was scrolled.</summary>
        public static Vector2 Show(Vector2 scroll, float height, int count, Action<int> row)
        {
            scroll = EditorGUILayout.BeginScrollView(scroll, GUILayout.Height(height));
            int first = Math.Max(0, Math.Min((int)(scroll.y / RowHeight), count - 1));
            int end = Math.Min(count, first + (int)(height / RowHeight) + 2);
            GUILayout.Space(first * RowHeight);
            for (int i = first; i < end; i++) row(i);
            GUILayout.Space((count - end) * RowHeight);
            EditorGUILayout.EndScrollView();
            return scroll;
        }
    }

    /// <summary>One object in the list of the scene, with the result of the scan and a field to correct it.</summary>
    internal static class ScanRow
    {
        public static string Describe(HapticObject shown)
        {
            return shown.ScannedMaterial + ", by " + shown.ScannedBy + ", " + shown.ScannedConfidence.ToString("P0");
        }

        public static void Show(HapticObject shown)
        {
            string before = shown.ChosenMaterial;
            string label = shown.ScannedMaterial.Length > 0 ? shown.name + ": " + Describe(shown) : shown.name + ": not scanned";
            string chosen = MaterialNames.Field(label, before);
            if (chosen == before) return;
            Persisted.Change(shown, "Choose material", () => shown.ChosenMaterial = chosen);
        }
    }
}
