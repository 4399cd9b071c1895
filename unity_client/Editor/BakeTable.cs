using System;
using System.Collections.Generic;
using System.IO;
using HapticVLM.Baked;
using Map = System.Collections.Generic.Dictionary<string, object>;

namespace HapticVLM.Editor
{
    /// <summary>One surface of `materials.json`, as the window shows it.</summary>
    [Serializable]
    internal sealed class BakeRow
    {
        public string ObjectId;
        public int Surface;
        public string Name;
        public string Material; // empty: nothing is felt
        public string By;
        public float Belief;

        public bool IsUnsure { get { return By != BakeTable.ByHand && (Material.Length == 0 || Belief < ObjectScanner.SureConfidence); } }
    }

    /// <summary>Reads the surfaces of a `materials.json` and writes corrections into it; all else in the file is kept.</summary>
    internal static class BakeTable
    {
        public const string ByHand = "hand";
        const string Undecided = "unknown";

        /// <summary>Returns all surfaces, the unsure ones first. Throws FormatException for another file.</summary>
        public static List<BakeRow> Read(string file, Func<string, int, string> nameOf)
        {
            string content = File.ReadAllText(file);
            BakedScene.Open(content); // names what is wrong in it
            var rows = new List<BakeRow>();
            foreach (KeyValuePair<string, object> each in Objects((Map)Json.Parse(content)))
            {
                List<object> surfaces = SurfacesOf(each.Value);
                for (int i = 0; i < surfaces.Count; i++)
                {
                    var surface = (Map)surfaces[i];
                    rows.Add(new BakeRow
                    {
                        ObjectId = each.Key,
                        Surface = i,
                        Name = nameOf(each.Key, i) ?? each.Key,
                        Material = surface["material"] as string ?? "",
                        By = (string)surface["by"],
                        Belief = (float)(double)surface["belief"],
                    });
                }
            }
            var sure = rows.FindAll(row => !row.IsUnsure);
            rows.RemoveAll(row => !row.IsUnsure);
            rows.AddRange(sure);
            return rows;
        }

        /// <summary>Writes the rows that a person corrected, and those whose correction was withdrawn or undone.</summary>
        public static void Write(string file, List<BakeRow> rows)
        {
            var content = (Map)Json.Parse(File.ReadAllText(file));
            Map objects = Objects(content);
            foreach (BakeRow row in rows)
            {
                object entry;
                if (!objects.TryGetValue(row.ObjectId, out entry)) continue;
                var surface = (Map)SurfacesOf(entry)[row.Surface];
                if (row.By != ByHand && (string)surface["by"] != ByHand) continue;
                surface["material"] = row.Material.Length == 0 ? null : row.Material;
                surface["by"] = row.By;
                surface["belief"] = (double)row.Belief;
                if (row.By == ByHand) surface["impact_gain"] = 1.0;
            }
            File.WriteAllText(file, JsonText.Of(content));
        }

        /// <summary>Corrects a row; an empty material leaves the surface to the next bake.</summary>
        public static void Correct(BakeRow row, string material)
        {
            row.Material = material.Trim();
            row.By = row.Material.Length == 0 ? Undecided : ByHand;
            row.Belief = row.Material.Length == 0 ? 0f : 1f;
        }

        static Map Objects(Map content)
        {
            return (Map)content["objects"];
        }

        static List<object> SurfacesOf(object entry)
        {
            return (List<object>)((Map)entry)["surfaces"];
        }
    }
}
