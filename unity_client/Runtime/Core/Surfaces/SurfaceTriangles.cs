using System;

namespace HapticVLM
{
    /// <summary>
    /// The triangles of one mesh, each with its surface (sub-mesh), and the search for the one nearest to
    /// a point. The triangles are sorted along a Morton curve, so that neighbours in the list are
    /// neighbours in space. Each node of a binary tree has the box around a run of them. A search visits
    /// the nearer box first and omits boxes that are farther than the nearest triangle so far. It
    /// allocates nothing. Instances do not change after construction.
    /// </summary>
    public sealed class SurfaceTriangles
    {
        const int LeafSize = 4;
        const int CellsPerAxis = 1024; // of the Morton curve; 3 x 10 bits

        readonly float[] corners; // 9 of each triangle, in the order of the curve
        readonly byte[] surfaces; // of each triangle, in the same order
        readonly float[] boxes; // 6 of each node: least x, y, z, greatest x, y, z; the children of node i are 2i+1 and 2i+2
        readonly int depth;

        struct Search
        {
            public Vec3 Point;
            public Vec3 Scale;
            public double Least; // squared distance, m2
            public int Triangle;
        }

        /// <summary>
        /// Takes the vertices of a mesh (3 numbers each) and the triangles of each of its surfaces (3 indices of
        /// vertices each). Throws ArgumentException for more than 256 surfaces.
        /// </summary>
        public SurfaceTriangles(float[] vertices, int[][] triangles)
        {
            if (triangles.Length > byte.MaxValue + 1) throw new ArgumentException("a mesh has at most 256 surfaces here", "triangles");
            int count = 0;
            for (int s = 0; s < triangles.Length; s++) count += triangles[s].Length / 3;
            Count = count;
            corners = new float[9 * count];
            surfaces = new byte[count];
            Fill(vertices, triangles);
            Sort();
            while (count > LeafSize << depth) depth++;
            boxes = new float[6 * ((2 << depth) - 1)];
            if (count > 0) Enclose(0, 0, count, depth);
        }

        /// <summary>Number of triangles.</summary>
        public int Count { get; private set; }

        /// <summary>
        /// Returns the surface of the triangle nearest to a point, if one is nearer than the square root of `leastM2`,
        /// and sets that to its squared distance; else -1. The point is in the frame of the mesh and in metres: the
        /// vertices are multiplied by `scale`.
        /// </summary>
        public int Nearest(Vec3 pointM, Vec3 scale, ref double leastM2)
        {
            if (Count == 0) return -1;
            var search = new Search { Point = pointM, Scale = scale, Least = leastM2, Triangle = -1 };
            Visit(0, 0, Count, depth, ref search);
            leastM2 = search.Least;
            return search.Triangle < 0 ? -1 : surfaces[search.Triangle];
        }

        /// <summary>Returns the area of triangles (3 indices of vertices each), in squared units of the vertices.</summary>
        public static double Area(float[] vertices, int[] triangles)
        {
            double sum = 0.0;
            for (int i = 0; i + 2 < triangles.Length; i += 3)
            {
                Vec3 a = At(vertices, 3 * triangles[i]);
                Vec3 u = At(vertices, 3 * triangles[i + 1]) - a, v = At(vertices, 3 * triangles[i + 2]) - a;
                double area = 0.5 * Math.Sqrt(Math.Max(0.0, Vec3.Dot(u, u) * Vec3.Dot(v, v) - Vec3.Dot(u, v) * Vec3.Dot(u, v)));
                if (!double.IsNaN(area)) sum += area;
            }
            return sum;
        }

        void Fill(float[] vertices, int[][] triangles)
        {
            int at = 0;
            for (int s = 0; s < triangles.Length; s++)
            {
                for (int i = 0; i + 2 < triangles[s].Length; i += 3, at++)
                {
                    surfaces[at] = (byte)s;
                    for (int corner = 0; corner < 3; corner++) Array.Copy(vertices, 3 * triangles[s][i + corner], corners, 9 * at + 3 * corner, 3);
                }
            }
        }

        void Sort()
        {
            var least = new float[3];
            var cell = new double[3]; // cells of the curve per unit of the vertices
            for (int axis = 0; axis < 3; axis++)
            {
                float low = float.PositiveInfinity, high = float.NegativeInfinity;
                for (int i = axis; i < corners.Length; i += 3)
                {
                    if (corners[i] < low) low = corners[i];
                    if (corners[i] > high) high = corners[i];
                }
                least[axis] = low;
                cell[axis] = high > low ? CellsPerAxis / ((double)high - low) : 0.0;
            }
            var keys = new uint[Count];
            var order = new int[Count];
            for (int i = 0; i < Count; i++)
            {
                order[i] = i;
                for (int axis = 0; axis < 3; axis++)
                {
                    int at = 9 * i + axis;
                    double middle = ((double)corners[at] + corners[at + 3] + corners[at + 6]) / 3.0;
                    keys[i] |= Spread((middle - least[axis]) * cell[axis]) << axis;
                }
            }
            Array.Sort(keys, order);
            Reorder(order);
        }

        void Reorder(int[] order)
        {
            var oldCorners = (float[])corners.Clone();
            var oldSurfaces = (byte[])surfaces.Clone();
            for (int i = 0; i < Count; i++)
            {
                Array.Copy(oldCorners, 9 * order[i], corners, 9 * i, 9);
                surfaces[i] = oldSurfaces[order[i]];
            }
        }

        /// <summary>Spreads the ten bits of a cell's number to every third bit.</summary>
        static uint Spread(double cell)
        {
            uint bits = cell > 0.0 ? (uint)Math.Min(cell, CellsPerAxis - 1) : 0u; // NaN counts as 0
            bits = (bits | bits << 16) & 0x030000FFu;
            bits = (bits | bits << 8) & 0x0300F00Fu;
            bits = (bits | bits << 4) & 0x030C30C3u;
            return (bits | bits << 2) & 0x09249249u;
        }

        /// <summary>Sets the box of a node around its triangles, from `from` to before `to`, and those of the nodes below it.</summary>
        void Enclose(int node, int from, int to, int levels)
        {
            if (levels > 0)
            {
                int middle = (from + to) / 2;
                Enclose(2 * node + 1, from, middle, levels - 1);
                Enclose(2 * node + 2, middle, to, levels - 1);
            }
            for (int axis = 0; axis < 3; axis++)
            {
                float low = float.PositiveInfinity, high = float.NegativeInfinity;
                if (levels > 0)
                {
                    low = Math.Min(boxes[6 * (2 * node + 1) + axis], boxes[6 * (2 * node + 2) + axis]);
                    high = Math.Max(boxes[6 * (2 * node + 1) + 3 + axis], boxes[6 * (2 * node + 2) + 3 + axis]);
                }
                for (int i = 9 * from + axis; levels == 0 && i < 9 * to; i += 3)
                {
                    if (corners[i] < low) low = corners[i];
                    if (corners[i] > high) high = corners[i];
                }
                boxes[6 * node + axis] = low;
                boxes[6 * node + 3 + axis] = high;
            }
        }

        void Visit(int node, int from, int to, int levels, ref Search search)
        {
            if (levels == 0)
            {
                for (int i = from; i < to; i++) Compare(i, ref search);
                return;
            }
            int left = 2 * node + 1, middle = (from + to) / 2;
            double toLeft = ToBox(left, ref search), toRight = ToBox(left + 1, ref search);
            bool isLeftFirst = toLeft <= toRight;
            if (isLeftFirst && toLeft < search.Least) Visit(left, from, middle, levels - 1, ref search);
            if (toRight < search.Least) Visit(left + 1, middle, to, levels - 1, ref search);
            if (!isLeftFirst && toLeft < search.Least) Visit(left, from, middle, levels - 1, ref search);
        }

        double ToBox(int node, ref Search search)
        {
            int at = 6 * node;
            double x = Outside(search.Point.X, boxes[at] * search.Scale.X, boxes[at + 3] * search.Scale.X);
            double y = Outside(search.Point.Y, boxes[at + 1] * search.Scale.Y, boxes[at + 4] * search.Scale.Y);
            double z = Outside(search.Point.Z, boxes[at + 2] * search.Scale.Z, boxes[at + 5] * search.Scale.Z);
            return x * x + y * y + z * z;
        }

        static double Outside(double value, double end, double otherEnd)
        {
            double low = Math.Min(end, otherEnd), high = Math.Max(end, otherEnd); // a negative scale swaps them
            return value < low ? low - value : value > high ? value - high : 0.0;
        }

        void Compare(int triangle, ref Search search)
        {
            Vec3 a = Corner(9 * triangle, ref search), b = Corner(9 * triangle + 3, ref search), c = Corner(9 * triangle + 6, ref search);
            Vec3 offset = search.Point - NearestPoint(search.Point, a, b, c);
            double distance = Vec3.Dot(offset, offset);
            if (!(distance < search.Least)) return;
            search.Least = distance;
            search.Triangle = triangle;
        }

        /// <summary>Returns the point of a triangle nearest to p, by the region of its plane that p lies over (Ericson, Real-Time Collision Detection, 5.1.5).</summary>
        static Vec3 NearestPoint(Vec3 p, Vec3 a, Vec3 b, Vec3 c)
        {
            Vec3 ab = b - a, ac = c - a;
            double d1 = Vec3.Dot(ab, p - a), d2 = Vec3.Dot(ac, p - a);
            if (d1 <= 0.0 && d2 <= 0.0) return a;
            double d3 = Vec3.Dot(ab, p - b), d4 = Vec3.Dot(ac, p - b);
            if (d3 >= 0.0 && d4 <= d3) return b;
            double overC = d1 * d4 - d3 * d2;
            if (overC <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + ab * (d1 / (d1 - d3));
            double d5 = Vec3.Dot(ab, p - c), d6 = Vec3.Dot(ac, p - c);
            if (d6 >= 0.0 && d5 <= d6) return c;
            double overB = d5 * d2 - d1 * d6;
            if (overB <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + ac * (d2 / (d2 - d6));
            double overA = d3 * d6 - d5 * d4;
            if (overA <= 0.0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / (d4 - d3 + d5 - d6));
            return a + ab * (overB / (overA + overB + overC)) + ac * (overC / (overA + overB + overC));
        }

        Vec3 Corner(int at, ref Search search)
        {
            return new Vec3(corners[at] * search.Scale.X, corners[at + 1] * search.Scale.Y, corners[at + 2] * search.Scale.Z);
        }

        static Vec3 At(float[] vertices, int at)
        {
            return new Vec3(vertices[at], vertices[at + 1], vertices[at + 2]);
        }
    }
}
