using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// The surfaces of one object, the largest first, and the one that a hand touches. The sub-meshes of all its
    /// renderers are its surfaces; those with the same material are one. Of a LOD Group only the first level counts.
    /// A touch is on the surface of the nearest triangle in kept copies of the meshes. If one of them cannot be kept,
    /// rays against a Mesh Collider with that mesh find it. Otherwise a touch is on the largest surface.
    /// </summary>
    internal sealed class ObjectSurfaces
    {
        const int MaxSurfaces = (int)Touch.SurfaceMax + 1;
        const float RayStartM = 0.03f; // behind the hand, which may be slightly inside the surface
        const float RayM = 0.15f;
        const int MaxWarnings = 32;

        /// <summary>The sub-meshes that one renderer draws.</summary>
        sealed class Part
        {
            public Transform Place;
            public Mesh Mesh;
            public bool IsRigid; // its triangles are where the mesh has them: not skinned, not in a static batch
            public KeptMesh Kept;
            public int[] Slots; // slot in `order` of each sub-mesh; -1 for one that is not drawn
        }

        static readonly List<Renderer> Renderers = new List<Renderer>();
        static readonly List<LODGroup> Groups = new List<LODGroup>();
        static readonly List<Material> Drawn = new List<Material>();
        static readonly HashSet<string> Warned = new HashSet<string>();
        static readonly Vector3[] Rays = Directions();

        readonly List<Part> parts = new List<Part>();
        readonly SurfaceOrder order = new SurfaceOrder();
        readonly List<int> largestFirst;
        readonly TextureMap[] maps; // of each surface

        /// <summary>Reads the surfaces of an object and, if `keeps`, copies its meshes for touches. Release them once.</summary>
        public ObjectSurfaces(HapticObject of, bool keeps)
        {
            FindDrawn(of);
            for (int i = 0; i < Renderers.Count; i++) Add(Renderers[i]);
            bool isKept = keeps && order.Count > 1 && Keep(of);
            for (int i = 0; i < parts.Count; i++) Measure(parts[i], isKept);
            largestFirst = order.LargestFirst(MaxSurfaces);
            maps = new TextureMap[keeps ? Count : 0];
            for (int i = 0; i < maps.Length; i++) maps[i] = TextureMap.Of(MaterialOf(i));
        }

        /// <summary>Number of surfaces that the scene states.</summary>
        public int Count { get { return largestFirst.Count; } }

        /// <summary>The material of a surface; the largest is the first.</summary>
        public Material MaterialOf(int surface)
        {
            return (Material)order.MaterialOf(largestFirst[surface]);
        }

        /// <summary>The texture map of a surface; null if it has none.</summary>
        public TextureMap MapOf(int surface)
        {
            return surface < maps.Length ? maps[surface] : null;
        }

        public void Release()
        {
            for (int i = 0; i < parts.Count; i++)
            {
                if (parts[i].Kept != null) parts[i].Kept.Release();
                parts[i].Kept = null;
            }
        }

        /// <summary>Returns the surface that a hand at this position touches; null if it is not known.</summary>
        public int? At(Collider collider, Vector3 position)
        {
            if (Count < 2) return null;
            int slot = -1;
            double least = double.PositiveInfinity;
            for (int i = 0; i < parts.Count; i++)
            {
                SurfaceTriangles triangles = parts[i].Kept == null ? null : parts[i].Kept.Triangles;
                if (triangles == null || parts[i].Place == null) continue;
                Transform place = parts[i].Place;
                int subMesh = triangles.Nearest(HandMotion.On(place, position), HandMotion.Exact(place.lossyScale), ref least);
                if (subMesh >= 0) slot = parts[i].Slots[subMesh];
            }
            if (double.IsPositiveInfinity(least)) slot = SlotByRays(collider, position);
            int surface = slot < 0 ? -1 : largestFirst.IndexOf(slot);
            return surface < 0 ? (int?)null : surface;
        }

        /// <summary>Finds the renderers of the object itself, without those of lower levels of detail.</summary>
        static void FindDrawn(HapticObject of)
        {
            of.GetComponentsInChildren(Renderers);
            of.GetComponentsInChildren(Groups);
            Renderers.RemoveAll(renderer => !renderer.enabled || renderer.GetComponentInParent<HapticObject>() != of);
            for (int i = 0; i < Groups.Count; i++)
            {
                LOD[] levels = Groups[i].GetLODs();
                for (int level = 1; level < levels.Length; level++)
                    Renderers.RemoveAll(renderer => Contains(levels[level], renderer) && !Contains(levels[0], renderer));
            }
        }

        static bool Contains(LOD level, Renderer renderer)
        {
            return level.renderers != null && Array.IndexOf(level.renderers, renderer) >= 0;
        }

        void Add(Renderer renderer)
        {
            Mesh mesh = CaptureMeshes.MeshOf(renderer);
            if (mesh == null) return;
            renderer.GetSharedMaterials(Drawn);
            bool isBatched = renderer.isPartOfStaticBatch;
            int first = isBatched ? ((MeshRenderer)renderer).subMeshStartIndex : 0;
            // A static batch has the meshes of several objects in one, in another frame. A Mesh Collider still has the original.
            var collider = isBatched ? renderer.GetComponent<MeshCollider>() : null;
            if (collider != null && collider.sharedMesh != null)
            {
                mesh = collider.sharedMesh;
                first = 0;
                isBatched = false;
            }
            var part = new Part { Place = renderer.transform, Mesh = mesh, IsRigid = !(renderer is SkinnedMeshRenderer) && !isBatched };
            part.Slots = new int[mesh.subMeshCount];
            for (int i = 0; i < part.Slots.Length; i++)
            {
                bool isDrawn = i >= first && i - first < Drawn.Count && Drawn[i - first] != null;
                part.Slots[i] = isDrawn ? order.SlotOf(Drawn[i - first]) : -1;
            }
            parts.Add(part);
        }

        /// <summary>Copies all meshes or none, because a search in some of them could miss the nearest triangle.</summary>
        bool Keep(HapticObject of)
        {
            for (int i = 0; i < parts.Count; i++)
            {
                string reason = "is skinned, or part of a static batch without a Mesh Collider";
                if (parts[i].IsRigid) parts[i].Kept = KeptMesh.Of(parts[i].Mesh, out reason);
                if (parts[i].Kept != null) continue;
                Release();
                Warn(parts[i], reason, of);
                return false;
            }
            return true;
        }

        /// <summary>Adds areas in the world, or numbers of triangles if one mesh has no known area.</summary>
        void Measure(Part part, bool isKept)
        {
            Vec3 scale = HandMotion.Exact(part.Place.lossyScale);
            double perUnit = Math.Pow(Math.Abs(scale.X * scale.Y * scale.Z), 2.0 / 3.0); // exact if the scale is the same along all axes
            for (int i = 0; i < part.Slots.Length; i++)
            {
                if (part.Slots[i] < 0) continue;
                order.Grow(part.Slots[i], isKept ? perUnit * part.Kept.Areas[i] : KeptMesh.TrianglesOf(part.Mesh, i));
            }
        }

        static void Warn(Part part, string reason, HapticObject of)
        {
            var collider = part.Place.GetComponent<MeshCollider>();
            bool isFoundByRays = part.IsRigid && collider != null && !collider.convex && collider.sharedMesh == part.Mesh;
            if (isFoundByRays || Warned.Count >= MaxWarnings || !Warned.Add(part.Mesh.name)) return;
            Debug.LogWarning("HapticVLM: a touch of '" + of.name + "' feels only the largest of its surfaces, because its mesh '"
                + part.Mesh.name + "' " + reason + ".", of);
        }

        /// <summary>Returns the slot of the triangle that rays in all directions hit nearest to the hand; -1 if there is none.</summary>
        int SlotByRays(Collider collider, Vector3 position)
        {
            var met = collider as MeshCollider;
            if (ReferenceEquals(met, null) || met.convex) return -1; // only other meshes report the triangle that was hit
            int slot = -1;
            float least = float.PositiveInfinity;
            Part part = null;
            for (int i = 0; i < parts.Count && part == null; i++) part = parts[i].IsRigid && parts[i].Mesh == met.sharedMesh ? parts[i] : null;
            for (int i = 0; part != null && i < Rays.Length; i++)
            {
                RaycastHit hit;
                if (!met.Raycast(new Ray(position - Rays[i] * RayStartM, Rays[i]), out hit, RayM)) continue;
                float distance = (hit.point - position).magnitude;
                if (distance >= least) continue;
                least = distance;
                slot = SlotOf(part, hit.triangleIndex);
            }
            return slot;
        }

        /// <summary>Returns the slot of a triangle of the whole mesh, whose sub-meshes follow each other.</summary>
        static int SlotOf(Part part, int triangle)
        {
            for (int i = 0; i < part.Slots.Length && triangle >= 0; i++)
            {
                int count = KeptMesh.TrianglesOf(part.Mesh, i);
                if (triangle < count) return part.Slots[i];
                triangle -= count;
            }
            return -1;
        }

        /// <summary>Returns the directions to the 6 faces and 8 corners of a cube, so that one of them nearly faces any surface.</summary>
        static Vector3[] Directions()
        {
            var directions = new List<Vector3>();
            for (int x = -1; x <= 1; x++)
            {
                for (int y = -1; y <= 1; y++)
                {
                    for (int z = -1; z <= 1; z++)
                    {
                        int axes = Math.Abs(x) + Math.Abs(y) + Math.Abs(z);
                        if (axes == 1 || axes == 3) directions.Add(new Vector3(x, y, z) * (1f / (float)Math.Sqrt(axes)));
                    }
                }
            }
            return directions.ToArray();
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            Warned.Clear();
        }
    }
}
