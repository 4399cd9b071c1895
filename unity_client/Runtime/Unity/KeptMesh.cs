using System;
using System.Collections.Generic;
using System.Threading;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// A copy of the triangles of one mesh, which finds the sub-mesh that a hand touches. Objects that draw the same
    /// mesh share it. A thread prepares the search, so that neither a frame nor a touch waits for it.
    /// </summary>
    internal sealed class KeptMesh
    {
        const int MaxTriangles = 250000; // of all kept meshes together: 16 MB; our choice
        const int MaxSubMeshes = 256;

        static readonly Dictionary<Mesh, KeptMesh> All = new Dictionary<Mesh, KeptMesh>();
        static readonly List<Vector3> Vertices = new List<Vector3>();
        static readonly List<int> Indices = new List<int>();
        static int keptTriangles;

        readonly Mesh mesh;
        readonly int triangleCount;
        int users = 1;
        volatile SurfaceTriangles triangles;

        KeptMesh(Mesh mesh, int triangleCount)
        {
            this.mesh = mesh;
            this.triangleCount = triangleCount;
            keptTriangles += triangleCount;
            All[mesh] = this;
        }

        /// <summary>Area of each sub-mesh, in squared units of the mesh.</summary>
        public double[] Areas { get; private set; }

        /// <summary>The search; null until it is prepared.</summary>
        public SurfaceTriangles Triangles { get { return triangles; } }

        /// <summary>Returns the copy of a mesh, to be released once; null with the reason if it cannot be copied.</summary>
        public static KeptMesh Of(Mesh mesh, out string reason)
        {
            KeptMesh kept;
            reason = null;
            if (All.TryGetValue(mesh, out kept)) kept.users++;
            else kept = Copied(mesh, out reason);
            return kept;
        }

        public void Release()
        {
            if (--users > 0) return;
            keptTriangles -= triangleCount;
            All.Remove(mesh);
        }

        /// <summary>Number of triangles of a sub-mesh, also of a mesh that is not readable; 0 if it has lines or points.</summary>
        public static int TrianglesOf(Mesh mesh, int subMesh)
        {
            return mesh.GetTopology(subMesh) == MeshTopology.Triangles ? (int)(mesh.GetIndexCount(subMesh) / 3) : 0;
        }

        static KeptMesh Copied(Mesh mesh, out string reason)
        {
            int count = 0;
            for (int i = 0; i < mesh.subMeshCount; i++) count += TrianglesOf(mesh, i);
            const string Cure = "give the object a Mesh Collider with this mesh";
            if (!mesh.isReadable) reason = "is not readable: tick Read/Write in its import settings, or " + Cure;
            else if (mesh.subMeshCount > MaxSubMeshes) reason = "has more than " + MaxSubMeshes + " sub-meshes: " + Cure;
            else reason = keptTriangles + count > MaxTriangles ? "is beyond the limit of " + MaxTriangles + " triangles for all objects: " + Cure : null;
            return reason == null ? Copied(mesh, count) : null;
        }

        static KeptMesh Copied(Mesh mesh, int count)
        {
            var kept = new KeptMesh(mesh, count) { Areas = new double[mesh.subMeshCount] };
            mesh.GetVertices(Vertices);
            var vertices = new float[3 * Vertices.Count];
            for (int i = 0; i < Vertices.Count; i++)
            {
                vertices[3 * i] = Vertices[i].x;
                vertices[3 * i + 1] = Vertices[i].y;
                vertices[3 * i + 2] = Vertices[i].z;
            }
            var subMeshes = new int[mesh.subMeshCount][];
            for (int i = 0; i < subMeshes.Length; i++)
            {
                Indices.Clear();
                if (TrianglesOf(mesh, i) > 0) mesh.GetTriangles(Indices, i);
                subMeshes[i] = Indices.ToArray();
                kept.Areas[i] = SurfaceTriangles.Area(vertices, subMeshes[i]);
            }
            ThreadPool.QueueUserWorkItem(_ => kept.Order(vertices, subMeshes));
            return kept;
        }

        // Unity aborts the pool's threads when it unloads the scripts; Array.Sort wraps that abort in an error, which would end the process.
        void Order(float[] vertices, int[][] subMeshes)
        {
            try { triangles = new SurfaceTriangles(vertices, subMeshes); }
            catch (InvalidOperationException error) when (error.InnerException is ThreadAbortException) { }
        }

        [RuntimeInitializeOnLoadMethod(RuntimeInitializeLoadType.SubsystemRegistration)]
        static void ForgetLastPlay()
        {
            All.Clear();
            keptTriangles = 0;
        }
    }
}
