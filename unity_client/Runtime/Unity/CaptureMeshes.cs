using System.Collections.Generic;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Draws the meshes of one object for one camera only. The object itself, its layer and its
    /// colliders are not changed. Supports meshes and skinned meshes; particles, trails, lines and
    /// sprites have no surface that a hand could touch.
    /// </summary>
    internal sealed class CaptureMeshes
    {
        readonly List<Renderer> renderers = new List<Renderer>();
        readonly List<Material> materials = new List<Material>();
        readonly List<Mesh> baked = new List<Mesh>();
        readonly MaterialPropertyBlock properties = new MaterialPropertyBlock();
        int bakedCount;

        /// <summary>Finds the renderers to draw and their bounds; false if there are none.</summary>
        public bool Find(HapticObject target, out Bounds bounds)
        {
            bounds = default(Bounds);
            target.GetComponentsInChildren(renderers);
            for (int i = renderers.Count - 1; i >= 0; i--)
            {
                bool isDrawn = renderers[i].enabled && renderers[i].GetComponentInParent<HapticObject>() == target && MeshOf(renderers[i]) != null;
                if (!isDrawn) renderers.RemoveAt(i);
            }
            for (int i = 0; i < renderers.Count; i++)
            {
                if (i == 0) bounds = renderers[0].bounds;
                else bounds.Encapsulate(renderers[i].bounds);
            }
            return renderers.Count > 0;
        }

        /// <summary>Queues the renderers from Find on this layer for the next render of this camera.</summary>
        public void Draw(Camera camera, int layer)
        {
            bakedCount = 0;
            for (int i = 0; i < renderers.Count; i++)
            {
                var skinned = renderers[i] as SkinnedMeshRenderer;
                if (skinned == null) Draw(renderers[i], MeshOf(renderers[i]), renderers[i].localToWorldMatrix, camera, layer);
                else Draw(skinned, Baked(skinned), skinned.transform.localToWorldMatrix, camera, layer);
            }
        }

        public void Destroy()
        {
            for (int i = 0; i < baked.Count; i++) Platform.Destroy(baked[i]);
            baked.Clear();
        }

        /// <summary>Returns the mesh that a renderer draws; null for particles, trails, lines and sprites.</summary>
        public static Mesh MeshOf(Renderer renderer)
        {
            var skinned = renderer as SkinnedMeshRenderer;
            if (skinned != null) return skinned.sharedMesh;
            var filter = renderer is MeshRenderer ? renderer.GetComponent<MeshFilter>() : null;
            return filter == null ? null : filter.sharedMesh;
        }

        void Draw(Renderer renderer, Mesh mesh, Matrix4x4 place, Camera camera, int layer)
        {
            renderer.GetSharedMaterials(materials);
            renderer.GetPropertyBlock(properties);
            // A static batch shares one mesh between objects, each with submeshes of its own.
            int first = renderer.isPartOfStaticBatch ? ((MeshRenderer)renderer).subMeshStartIndex : 0;
            for (int i = 0; i < materials.Count; i++)
            {
                if (materials[i] == null) continue;
                int part = Mathf.Min(first + i, mesh.subMeshCount - 1);
                Graphics.DrawMesh(mesh, place, materials[i], layer, camera, part, properties, false, false, true);
            }
        }

        Mesh Baked(SkinnedMeshRenderer skinned)
        {
            if (bakedCount == baked.Count) baked.Add(new Mesh { hideFlags = HideFlags.HideAndDontSave });
            Mesh mesh = baked[bakedCount++];
            skinned.BakeMesh(mesh, true);
            return mesh;
        }
    }
}
