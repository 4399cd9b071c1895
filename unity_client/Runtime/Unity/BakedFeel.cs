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

        /// <summary>
        /// Returns what is felt of an object, or of its surface with this material; null: the bake of the active Haptic
        /// Client has nothing of it. An object is found by its id, a copy by that of its original, others by their names.
        /// </summary>
        public static FeltSurface Find(GameObject of, Material material = null)
        {
            BakedScene baked = HapticClient.Active == null ? null : HapticClient.Active.Baked;
            if (baked == null || of == null) return null;
            var target = of.GetComponentInParent<HapticObject>();
            string id = target == null ? null : target.ObjectId;
            return Find(baked, id, target == null ? of : target.gameObject, material == null ? null : Appearance.NameOf(material), 0);
        }

        internal static FeltSurface Find(BakedScene baked, HapticObject target, int surface)
        {
            return Find(baked, target.ObjectId, target.gameObject, target.MaterialName(surface), surface);
        }

        static FeltSurface Find(BakedScene baked, string id, GameObject of, string material, int surface)
        {
            string path = Appearance.Name(of);
            BakeFound found = baked.Find(new BakeQuery
            {
                ObjectId = id,
                Paths = new[] { path, Copies.Replace(path, "") },
                Material = material == null ? null : Copies.Replace(material, ""),
                Surface = surface,
            });
            return found == null ? null : baked.SurfaceOf(found);
        }
    }
}
