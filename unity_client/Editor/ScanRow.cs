namespace HapticVLM.Editor
{
    /// <summary>One object in the list of the scene, with the result of the scan and a field to correct it.</summary>
    internal static class ScanRow
    {
        public const float Height = 20f; // a popup and its margin

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
