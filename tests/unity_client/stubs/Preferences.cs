using System.Collections.Generic;

namespace UnityEngine
{
    public static class PlayerPrefs
    {
        static readonly Dictionary<string, string> Kept = new Dictionary<string, string>();

        public static bool HasKey(string key) { return Kept.ContainsKey(key); }
        public static string GetString(string key) { return Kept[key]; }
        public static void SetString(string key, string value) { Kept[key] = value; }
        public static void DeleteKey(string key) { Kept.Remove(key); }
        public static void Save() { }
    }
}
