using System.Collections.Generic;
using System.Text.RegularExpressions;
using HapticVLM.Baked;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>Finds what an object of the scene is in a bake, also one that was made while the scene runs.</summary>
    public static class BakedFeel
    {
        // What Unity puts behind the names of copies: "Crate (3)", "Crate(Clone)", "Oak (Instance)".
        static readonly Regex Copies = new Regex(@"( ?(\(Clone\)|\(Instance\)|\(\d+\)))+(?=/|$)", RegexOptions.CultureInvariant);

        // What importers of glTF call the nameless node 3, which is "node3" in a bake: glTFast "Node-3", UnityGLTF "GLTFNode3".
        static readonly Regex Nameless = new Regex(@"(?<=^|/)(Node-|GLTFNode)(?=\d+(/|$))", RegexOptions.CultureInvariant);

        // What they make of a node beside itself: a further part of its mesh ("Cube_1"), one of many instances ("Cube_i7", "Instances/Instance 7").
        static readonly Regex Part = new Regex(@"/([^/]*_i?\d+|Instances/Instance \d+)$", RegexOptions.CultureInvariant);

        /// <summary>
        /// Returns what is felt of an object, or of its surface with this material; null: the bake of the active Haptic
        /// Client has nothing of it. An object is found by its id, a copy by that of its original, others by their names.
        /// </summary>
        public static FeltSurface Find(GameObject of, Material material = null)
        {
            BakedScene baked = HapticClient.Active == null ? null : HapticClient.Active.Baked;
            if (baked == null || of == null) return null;
            var target = of.GetComponentInParent<HapticObject>();
            var renderer = material == null ? of.GetComponent<Renderer>() : null;
            var drawn = new List<Material>();
            if (renderer != null) renderer.GetSharedMaterials(drawn);
            if (drawn.Count == 1) material = drawn[0];
            return Find(baked, target, material == null ? null : Appearance.NameOf(material), 0, of);
        }

        internal static FeltSurface Find(BakedScene baked, HapticObject target, int surface)
        {
            return Find(baked, target, target.MaterialName(surface), surface, target.gameObject);
        }

        static FeltSurface Find(BakedScene baked, HapticObject target, string material, int surface, GameObject of)
        {
            var paths = new List<string>();
            AddPaths(of, paths);
            if (target != null && target.gameObject != of) AddPaths(target.gameObject, paths);
            return baked.SurfaceOf(baked.Find(new BakeQuery
            {
                ObjectId = target == null ? null : target.ObjectId,
                Paths = paths.ToArray(),
                Material = material == null ? null : Copies.Replace(material, ""),
                Surface = surface,
            }));
        }

        static void AddPaths(GameObject of, List<string> paths)
        {
            string path = Appearance.PathOf(of.transform, of.name), plain = Nameless.Replace(Copies.Replace(path, ""), "node");
            paths.AddRange(new[] { Numbered(of.transform), Appearance.Name(of), path, plain, Part.Replace(plain, "") });
        }

        /// <summary>Returns a path with the numbers by which a bake tells siblings of one name apart; glTFast gives them itself, or not.</summary>
        static string Numbered(Transform of)
        {
            if (of.parent == null) return of.name;
            var used = new HashSet<string>();
            Transform sibling;
            string name;
            int at = 0;
            do
            {
                sibling = of.parent.GetChild(at++);
                name = sibling.name;
                for (int number = 0; !used.Add(name); number++) name = sibling.name + "_" + number;
            }
            while (sibling != of);
            return Numbered(of.parent) + "/" + name;
        }
    }
}
