using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>What is known of a touched thing. Paths are its names behind its parents', the best first.</summary>
    public sealed class BakeQuery
    {
        public string ObjectId;
        public string[] Paths = new string[0];

        /// <summary>Name of the touched material.</summary>
        public string Material;

        /// <summary>Index of the primitive in its glTF mesh; null: not known.</summary>
        public int? Primitive;

        public int Surface;

        /// <summary>Who spelled the paths: `three`, `godot`, or `scene` for an engine that keeps names.</summary>
        public string Engine = BakedScene.AsTheScene;
    }

    /// <summary>An object of a bake and a surface in it, found by `id`, `path` or `material`.</summary>
    public sealed class BakeFound
    {
        public string ObjectId;
        public int Surface;
        public string By;
    }

    /// <summary>
    /// The surfaces of `materials.json`. A thing is found by its id, else by the path of its names, else by its material's
    /// name; an index decides only between surfaces of which nothing else is known.
    /// </summary>
    public sealed class BakedScene
    {
        internal const string AsTheScene = "scene";
        const double Version = 2;

        sealed class Part
        {
            public FeltSurface Felt;
            public string[] Names;
            public double[] Primitives;
        }

        sealed class Spelling
        {
            public string[] Names;
            public string ObjectId;
            public string Engine;
            public HashSet<string> Others; // engines that spell it otherwise

            public bool IsOf(string engine)
            {
                return engine == Engine || Engine == AsTheScene && !Others.Contains(engine);
            }
        }

        readonly Dictionary<string, Part[]> objects = new Dictionary<string, Part[]>();
        readonly List<string> ids = new List<string>(); // in the order of the file
        readonly Dictionary<string, List<Spelling>> named = new Dictionary<string, List<Spelling>>(); // by an object's own name
        readonly Dictionary<string, BakeFound> ofMaterial = new Dictionary<string, BakeFound>();

        BakedScene(Table file)
        {
            double version = file.Get("version", Read.Number());
            if (version != Version) throw new FormatException("materials.json: version " + version + " is not " + Version + "; bake it again, or update the client");
            foreach (KeyValuePair<string, Table> each in file.Get("objects", Read.Map(Read.Part(part => part))))
            {
                string id = each.Key;
                ids.Add(id);
                Part[] parts = objects[id] = each.Value.Get("surfaces", Read.List(Read.Part(PartOf)));
                AddPaths(id, each.Value.Get("paths", Read.Map(Read.List(Read.As<string>)), new Dictionary<string, string[]>()));
                for (int i = 0; i < parts.Length; i++)
                {
                    foreach (string name in parts[i].Names)
                    {
                        if (!ofMaterial.ContainsKey(name)) ofMaterial[name] = new BakeFound { ObjectId = id, Surface = i, By = "material" };
                    }
                }
            }
        }

        /// <summary>Opens the contents of `materials.json`. Throws FormatException, which names the field.</summary>
        public static BakedScene Open(string json)
        {
            return new BakedScene(new Table("materials.json", Json.Parse(json)));
        }

        /// <summary>Returns what this is in the bake; null: nothing of it is known.</summary>
        public BakeFound Find(BakeQuery query)
        {
            if (query == null) return null;
            string id = ById(query.ObjectId);
            string by = id == null ? "path" : "id";
            if (id == null) id = ByPath(query);
            if (id != null && objects[id].Length > 0) return new BakeFound { ObjectId = id, Surface = SurfaceOf(objects[id], query), By = by };
            foreach (string name in NamesOf(query.Material))
            {
                BakeFound found;
                if (ofMaterial.TryGetValue(name, out found)) return found;
            }
            return null;
        }

        /// <summary>Returns how a surface feels; null: of nothing that was found.</summary>
        public FeltSurface SurfaceOf(BakeFound found)
        {
            Part[] surfaces = null;
            bool isThere = found != null && found.ObjectId != null && objects.TryGetValue(found.ObjectId, out surfaces) && found.Surface >= 0 && found.Surface < surfaces.Length;
            return isThere ? surfaces[found.Surface].Felt : null;
        }

        /// <summary>Returns the id or name that shares most pairs of letters with a name, because the ids that Unity makes are not words; null: there is none.</summary>
        public string Nearest(string name)
        {
            HashSet<string> pairs = PairsOf(name ?? "");
            string best = null;
            double most = -1.0;
            var names = new List<string>(ids);
            names.AddRange(named.Keys);
            foreach (string each in names)
            {
                HashSet<string> others = PairsOf(each);
                int all = pairs.Count + others.Count;
                others.IntersectWith(pairs);
                double share = 2.0 * others.Count / Math.Max(1, all);
                if (share <= most) continue;
                most = share;
                best = each;
            }
            return best;
        }

        /// <summary>Returns the object with this id, or the one that an id `original~copy` is a copy of.</summary>
        string ById(string id)
        {
            if (id == null) return null;
            if (objects.ContainsKey(id)) return id;
            int at = id.LastIndexOf('~');
            string original = at < 0 ? "" : id.Substring(0, at);
            return objects.ContainsKey(original) ? original : null;
        }

        /// <summary>Returns the object whose names agree farthest, from its own up to its parents'.</summary>
        string ByPath(BakeQuery query)
        {
            foreach (string path in query.Paths ?? new string[0])
            {
                string[] names = (path ?? "").Split('/');
                List<Spelling> candidates;
                if (!named.TryGetValue(names[names.Length - 1], out candidates)) continue;
                int most = -1;
                string best = null;
                bool bestHas = false;
                foreach (Spelling each in candidates)
                {
                    int rank = 2 * Shared(names, each.Names) + (each.IsOf(query.Engine) ? 1 : 0);
                    bool has = Has(each.ObjectId, query.Material);
                    if (rank < most || rank == most && (bestHas || !has)) continue;
                    most = rank;
                    best = each.ObjectId;
                    bestHas = has;
                }
                return best;
            }
            return null;
        }

        bool Has(string id, string material)
        {
            string[] wanted = NamesOf(material);
            return Array.Exists(objects[id], part => Array.Exists(part.Names, name => Array.IndexOf(wanted, name) >= 0));
        }

        void AddPaths(string id, Dictionary<string, string[]> paths)
        {
            var spellers = new HashSet<string>(paths.Keys);
            foreach (string engine in spellers)
            {
                foreach (string path in paths[engine])
                {
                    string[] names = path.Split('/');
                    List<Spelling> others;
                    if (!named.TryGetValue(names[names.Length - 1], out others)) named[names[names.Length - 1]] = others = new List<Spelling>();
                    others.Add(new Spelling { Names = names, ObjectId = id, Engine = engine, Others = spellers });
                }
            }
        }

        /// <summary>Returns the surface with this material's name, else this primitive, else this index, else 0.</summary>
        static int SurfaceOf(Part[] surfaces, BakeQuery query)
        {
            var candidates = new List<int>();
            foreach (string wanted in NamesOf(query.Material))
            {
                for (int i = 0; i < surfaces.Length; i++)
                {
                    if (Array.IndexOf(surfaces[i].Names, wanted) >= 0) candidates.Add(i);
                }
                if (candidates.Count > 0) break;
            }
            bool isNamed = candidates.Count > 0;
            for (int i = 0; !isNamed && i < surfaces.Length; i++) candidates.Add(i);
            foreach (int i in candidates)
            {
                if (query.Primitive != null && Array.IndexOf(surfaces[i].Primitives, (double)query.Primitive) >= 0) return i;
            }
            return candidates.Contains(query.Surface) ? query.Surface : candidates[0];
        }

        /// <summary>Returns a material's name as a whole, and without that of its texture's file before it.</summary>
        static string[] NamesOf(string name)
        {
            if (string.IsNullOrEmpty(name)) return new string[0];
            string last = name.Substring(name.LastIndexOf('/') + 1);
            return last.Length == 0 || last == name ? new[] { name } : new[] { name, last };
        }

        static int Shared(string[] names, string[] others)
        {
            int count = 0;
            while (count < names.Length && count < others.Length && names[names.Length - 1 - count] == others[others.Length - 1 - count]) count++;
            return count;
        }

        static HashSet<string> PairsOf(string text)
        {
            string low = text.ToLowerInvariant();
            var pairs = new HashSet<string>();
            for (int i = 0; i + 1 < low.Length; i++) pairs.Add(low.Substring(i, 2));
            return pairs;
        }

        static Part PartOf(Table table)
        {
            var felt = new FeltSurface
            {
                Material = table.Get("material", Read.As<string>, null),
                ImpactGain = table.Get("impact_gain", Read.Number(), 1.0),
                ThicknessM = table.Get("thickness_m", Read.Maybe(Read.Number()), null),
                Hum = table.Get("hum", Read.Part(HumOf), null),
            };
            double[] primitives = table.Get("primitives", Read.List(Read.Number()), new double[0]);
            return new Part { Felt = felt, Names = NamesOf(table.Get("name", Read.As<string>, null)), Primitives = primitives };
        }

        static FeltHum HumOf(Table hum)
        {
            Reader<double> number = Read.Number();
            return new FeltHum { FrequencyHz = hum.Get("frequency_hz", number), Level = hum.Get("level", number), Drives = hum.Get("drives", Read.List(number)) };
        }
    }
}
