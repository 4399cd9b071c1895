using System.Collections.Generic;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>The base-colour map of surfaces. Its hash is computed once a play session, whatever draws it.</summary>
    internal sealed class TextureMap
    {
        const int TransparentFrom = 2450; // RenderQueue.AlphaTest
        const int PruneFrom = 1024; // maps, of which some may be of scenes that were unloaded

        static readonly Dictionary<Texture2D, TextureMap> All = new Dictionary<Texture2D, TextureMap>();
        static readonly List<Texture2D> Destroyed = new List<Texture2D>();

        /// <summary>Maps that were not hashed yet, the oldest first.</summary>
        public static readonly Queue<TextureMap> Unhashed = new Queue<TextureMap>();

        public readonly Texture2D Image;

        /// <summary>Whether its alpha means transparency; in an opaque material it may be smoothness, or nothing.</summary>
        public readonly bool IsSeeThrough;

        /// <summary>Name of its contents; null until it was read. Set on a worker thread.</summary>
        public volatile string Hash;

        /// <summary>Number of readings that failed.</summary>
        public int Failures;

        TextureMap(Texture2D image, bool isSeeThrough)
        {
            Image = image;
            IsSeeThrough = isSeeThrough;
        }

        /// <summary>Returns the map of a material; null for none, and for one that changes, such as a video.</summary>
        public static TextureMap Of(Material material)
        {
            var image = Appearance.MapOf(material) as Texture2D;
            if (image == null) return null;
            TextureMap map;
            if (All.TryGetValue(image, out map)) return map;
            if (All.Count >= PruneFrom) Prune();
            map = new TextureMap(image, material.renderQueue >= TransparentFrom);
            All[image] = map;
            Unhashed.Enqueue(map);
            return map;
        }

        /// <summary>Returns the map with this hash, or null.</summary>
        public static TextureMap ByHash(string hash)
        {
            foreach (TextureMap map in All.Values)
            {
                if (map.Hash == hash) return map;
            }
            return null;
        }

        static void Prune()
        {
            foreach (Texture2D image in All.Keys)
            {
                if (image == null) Destroyed.Add(image);
            }
            foreach (Texture2D image in Destroyed) All.Remove(image);
            Destroyed.Clear();
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear();
            Unhashed.Clear();
        }
    }
}
