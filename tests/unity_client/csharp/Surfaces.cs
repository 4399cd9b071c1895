// Times the search for the surface that a hand touches, on a wavy sheet of triangles.
using System;
using HapticVLM;

public static class Surfaces
{
    const int Searches = 2000;

    // Prints the number of triangles, the time to prepare the search, and the median and 99th percentile of one search, all in ms.
    public static int Search(int atLeast)
    {
        int side = (int)Math.Ceiling(Math.Sqrt(atLeast / 2.0));
        float[] vertices = Sheet(side);
        int[][] triangles = Halves(side);
        new SurfaceTriangles(vertices, triangles); // compiles the code
        double began = Clock.Now;
        var sheet = new SurfaceTriangles(vertices, triangles);
        double preparedMs = 1e3 * (Clock.Now - began);
        var random = new Random(1);
        var times = new double[Searches];
        int first = 0;
        for (int i = -Searches; i < Searches; i++)
        {
            double x = 2.0 * random.NextDouble(), z = 2.0 * random.NextDouble();
            var hand = new Vec3(x, Height(x, z) + 0.04 * (random.NextDouble() - 0.5), z); // up to 2 cm from the surface
            double from = Clock.Now, least = double.PositiveInfinity;
            if (sheet.Nearest(hand, new Vec3(1.0, 1.0, 1.0), ref least) == 0) first++;
            if (i >= 0) times[i] = 1e3 * (Clock.Now - from);
        }
        Array.Sort(times);
        Console.WriteLine("triangles " + sheet.Count + " prepared_ms " + preparedMs.ToString("f3") + " median_ms " + times[Searches / 2].ToString("f5")
            + " p99_ms " + times[Searches * 99 / 100].ToString("f5") + " first_half " + (first / (2.0 * Searches)).ToString("f2"));
        return 0;
    }

    static double Height(double x, double z)
    {
        return 0.1 * Math.Sin(5.0 * x) * Math.Cos(7.0 * z);
    }

    static float[] Sheet(int side)
    {
        var vertices = new float[3 * (side + 1) * (side + 1)];
        for (int i = 0; i < vertices.Length / 3; i++)
        {
            double x = 2.0 * (i % (side + 1)) / side, z = 2.0 * (i / (side + 1)) / side;
            vertices[3 * i] = (float)x;
            vertices[3 * i + 1] = (float)Height(x, z);
            vertices[3 * i + 2] = (float)z;
        }
        return vertices;
    }

    // Two sub-meshes: the half with the smaller z, and the other one.
    static int[][] Halves(int side)
    {
        var halves = new[] { new int[6 * side * (side / 2)], new int[6 * side * (side - side / 2)] };
        var at = new int[2];
        for (int i = 0; i < side * side; i++)
        {
            int half = i / side < side / 2 ? 0 : 1, corner = i / side * (side + 1) + i % side;
            foreach (int vertex in new[] { corner, corner + 1, corner + side + 1, corner + 1, corner + side + 2, corner + side + 1 })
                halves[half][at[half]++] = vertex;
        }
        return halves;
    }
}
