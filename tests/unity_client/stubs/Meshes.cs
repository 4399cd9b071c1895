using System.Collections.Generic;

namespace UnityEngine
{
    public class Mesh : Object
    {
        public int subMeshCount { get; set; } = 1;
        public int Baked;
    }

    public class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public class MaterialPropertyBlock { }

    public class Renderer : Component
    {
        Vector3 offset, size;
        bool isSized; // else a unit cube, scaled

        public bool enabled { get; set; } = true;
        public bool isPartOfStaticBatch { get; set; }
        public Material sharedMaterial { get; set; }
        public Material material { get { return sharedMaterial = sharedMaterial ?? new Material(); } }
        public Matrix4x4 localToWorldMatrix { get { return transform.localToWorldMatrix; } }

        public Bounds bounds
        {
            get { return new Bounds(transform.position + offset, isSized ? size : transform.localScale); }
            set
            {
                offset = value.center - transform.position;
                size = value.extents * 2f;
                isSized = true;
            }
        }

        public void GetSharedMaterials(List<Material> m)
        {
            m.Clear();
            m.Add(sharedMaterial);
        }

        public void GetPropertyBlock(MaterialPropertyBlock properties) { Graphics.Next = this; }
    }

    public class MeshRenderer : Renderer
    {
        public int subMeshStartIndex { get; set; }
    }

    public class SkinnedMeshRenderer : Renderer
    {
        public Mesh sharedMesh { get; set; }

        public void BakeMesh(Mesh mesh, bool useScale) { mesh.Baked++; }
    }

    public class ParticleSystemRenderer : Renderer { }

    public static class Graphics
    {
        internal struct Drawn
        {
            public Renderer Of;
            public int Layer;
            public Camera For;
        }

        // The engine draws queued meshes when the camera renders, and clears the queue after the frame.
        internal static readonly List<Drawn> Queue = new List<Drawn>();
        internal static Renderer Next;
        public static readonly List<int> Submeshes = new List<int>();
        public static int MostQueued;

        public static void DrawMesh(
            Mesh mesh, Matrix4x4 matrix, Material material, int layer, Camera camera, int submeshIndex,
            MaterialPropertyBlock properties, bool castShadows, bool receiveShadows, bool useLightProbes)
        {
            Submeshes.Add(submeshIndex);
            Queue.Add(new Drawn { Of = Next, Layer = layer, For = camera });
            MostQueued = System.Math.Max(MostQueued, Queue.Count);
        }
    }

    public enum ShadowQuality { Disable = 0, HardOnly = 1, All = 2 }

    public static class QualitySettings
    {
        public static ShadowQuality shadows { get; set; } = ShadowQuality.All;
    }
}
