using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>The surfaces of `materials.json`, by object id.</summary>
    public sealed class BakedScene
    {
        private const double Version = 1;
        private readonly Dictionary<string, FeltSurface[]> objects = new Dictionary<string, FeltSurface[]>();

        private BakedScene(Table file)
        {
            if (file.Number("version") != Version)
            {
                throw new FormatException("materials.json: version " + file.Number("version") + " is not " + Version + "; bake it again, or update the client");
            }
            Table all = file.Part("objects");
            foreach (string id in all.Names)
            {
                Table each = all.Part(id);
                objects[id] = each.List("surfaces").ConvertAll(surface => Surface(new Table("materials.json." + id, surface))).ToArray();
            }
        }

        /// <summary>Opens the contents of `materials.json`. Throws FormatException, which names the field.</summary>
        public static BakedScene Open(string json)
        {
            return new BakedScene(new Table("materials.json", Json.Parse(json)));
        }

        /// <summary>Returns a surface of an object; its largest where it has no such surface, null for an unknown object.</summary>
        public FeltSurface Find(string objectId, int surface)
        {
            FeltSurface[] surfaces;
            if (objectId == null || !objects.TryGetValue(objectId, out surfaces) || surfaces.Length == 0) return null;
            return surfaces[surface < surfaces.Length ? surface : 0];
        }

        private static FeltSurface Surface(Table table)
        {
            return new FeltSurface
            {
                Material = table.Has("material") ? table.Text("material") : null,
                ImpactGain = table.Optional("impact_gain") ?? 1.0,
                ThicknessM = table.Optional("thickness_m"),
                Hum = table.Has("hum") ? Hum(table.Part("hum")) : null,
            };
        }

        private static FeltHum Hum(Table table)
        {
            return new FeltHum { FrequencyHz = table.Number("frequency_hz"), Level = table.Number("level"), Drives = table.Numbers("drives") };
        }
    }
}
