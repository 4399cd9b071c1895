using System.Collections.Generic;

namespace UnityEngine
{
    public enum MeshTopology { Triangles = 0, Lines = 3 }

    public class Mesh : Object
    {
        public Vector3[] Points = new Vector3[0];
        public int[][] Triangles = new int[0][]; // of each sub-mesh
        public int Baked;

        public int subMeshCount { get; set; } = 1;
        public bool isReadable { get; set; } = true;

        public MeshTopology GetTopology(int submesh) { return MeshTopology.Triangles; }

        public uint GetIndexCount(int submesh) { return submesh < Triangles.Length ? (uint)Triangles[submesh].Length : 0u; }

        public void GetVertices(List<Vector3> vertices)
        {
            if (!isReadable) Debug.LogError("Not allowed to access vertices on mesh '" + name + "'", this);
            vertices.Clear();
            vertices.AddRange(Points);
        }

        public void GetTriangles(List<int> triangles, int submesh)
        {
            if (!isReadable) Debug.LogError("Not allowed to access triangles on mesh '" + name + "'", this);
            triangles.Clear();
            triangles.AddRange(Triangles[submesh]);
        }
    }

    public struct LOD
    {
        public Renderer[] renderers;
    }

    public class LODGroup : Component
    {
        public LOD[] Levels = new LOD[0];

        public LOD[] GetLODs() { return Levels; }
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
        public Material[] sharedMaterials { get; set; } = { null };
        public Material sharedMaterial { get { return sharedMaterials[0]; } set { sharedMaterials = new[] { value }; } }
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
            m.AddRange(sharedMaterials);
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
        public static int MostQueued, Blits;

        // Draws a texture as it is, without filtering; the lowest row comes first, as in every texture of the engine.
        public static void Blit(Texture source, RenderTexture dest)
        {
            long bytes = System.GC.GetAllocatedBytesForCurrentThread();
            byte[] picture = ((Texture2D)source).Picture;
            for (int y = 0; y < dest.height; y++)
            {
                for (int x = 0; x < dest.width; x++)
                {
                    int from = 4 * (y * source.height / dest.height * source.width + x * source.width / dest.width);
                    System.Array.Copy(picture, from, dest.Rows, 4 * ((dest.height - 1 - y) * dest.width + x), 4);
                }
            }
            RenderTexture.active = dest;
            Blits++;
            Player.StandInBytes += System.GC.GetAllocatedBytesForCurrentThread() - bytes;
        }

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
