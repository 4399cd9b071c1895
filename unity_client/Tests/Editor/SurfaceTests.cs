using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    [TestFixture]
    public class SurfaceTests
    {
        static readonly Vec3 Unscaled = new Vec3(1.0, 1.0, 1.0);

        static Vec3 Any(Random random)
        {
            return new Vec3(random.NextDouble() - 0.5, random.NextDouble() - 0.5, random.NextDouble() - 0.5);
        }

        static float[] Numbers(params Vec3[] points)
        {
            var numbers = new List<float>();
            foreach (Vec3 p in points) numbers.AddRange(new[] { (float)p.X, (float)p.Y, (float)p.Z });
            return numbers.ToArray();
        }

        // Small triangles anywhere in a cube of 1 m, each of them a surface of its own.
        static Vec3[] Scattered(Random random, int count)
        {
            var corners = new Vec3[3 * count];
            for (int i = 0; i < count; i++)
            {
                Vec3 middle = Any(random);
                for (int corner = 0; corner < 3; corner++) corners[3 * i + corner] = middle + Any(random) * 0.1;
            }
            return corners;
        }

        [TestCase(1), TestCase(2), TestCase(5), TestCase(31), TestCase(256)]
        public void TheNearestOfManyTrianglesIsTheOneThatIsNearestByItself(int count)
        {
            var random = new Random(count);
            Vec3[] corners = Scattered(random, count);
            var triangles = new int[count][];
            for (int i = 0; i < count; i++) triangles[i] = new[] { 3 * i, 3 * i + 1, 3 * i + 2 };
            var all = new SurfaceTriangles(Numbers(corners), triangles);
            foreach (Vec3 scale in new[] { Unscaled, new Vec3(1.0, 5.0, 0.2), new Vec3(-2.0, 1.0, 1.0) })
            {
                for (int n = 0; n < 100; n++)
                {
                    Vec3 point = Any(random) * 2.0;
                    double least = double.PositiveInfinity, expected = double.PositiveInfinity;
                    int nearest = all.Nearest(point, scale, ref least), alone = -1;
                    for (int i = 0; i < count; i++)
                    {
                        var one = new SurfaceTriangles(Numbers(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]), new[] { new[] { 0, 1, 2 } });
                        if (one.Nearest(point, scale, ref expected) == 0) alone = i;
                    }
                    Assert.AreEqual(expected, least);
                    Assert.AreEqual(alone, nearest);
                }
            }
        }

        [Test]
        public void TheDistanceToATriangleIsThatToTheNearestOfItsPoints()
        {
            var random = new Random(3);
            for (int n = 0; n < 50; n++)
            {
                Vec3 a = Any(random), b = Any(random), c = Any(random), point = Any(random) * 2.0;
                double squared = double.PositiveInfinity, sampled = double.PositiveInfinity;
                new SurfaceTriangles(Numbers(a, b, c), new[] { new[] { 0, 1, 2 } }).Nearest(point, Unscaled, ref squared);
                const int Steps = 200;
                for (int i = 0; i <= Steps; i++)
                {
                    for (int j = 0; i + j <= Steps; j++)
                        sampled = Math.Min(sampled, (a + (b - a) * (i / (double)Steps) + (c - a) * (j / (double)Steps) - point).Length);
                }
                Assert.LessOrEqual(Math.Sqrt(squared), sampled + 1e-6);
                Assert.AreEqual(sampled, Math.Sqrt(squared), 0.01);
            }
        }

        [Test]
        public void AnotherMeshIsNearerOnlyIfItsTriangleIs()
        {
            var table = new SurfaceTriangles(Numbers(new Vec3(0, 0, 0), new Vec3(1, 0, 0), new Vec3(0, 0, 1)), new[] { new[] { 0, 1, 2 } });
            double least = 0.3 * 0.3;
            Assert.AreEqual(-1, table.Nearest(new Vec3(0.2, 0.4, 0.2), Unscaled, ref least));
            Assert.AreEqual(0, table.Nearest(new Vec3(0.2, 0.2, 0.2), Unscaled, ref least));
            Assert.AreEqual(0.04, least, 1e-9);
        }

        [Test]
        public void AMeshWithoutTrianglesAndOneWithCornersNowhereAreSearchedWithoutHarm()
        {
            double least = double.PositiveInfinity;
            Assert.AreEqual(-1, new SurfaceTriangles(new float[0], new[] { new int[0] }).Nearest(default(Vec3), Unscaled, ref least));
            var broken = new SurfaceTriangles(new[] { float.NaN, 0f, 0f, 1f, 0f, 0f, 0f, 1f, 0f, 0f, 0f, 5f }, new[] { new[] { 0, 1, 2 }, new[] { 1, 2, 3 } });
            Assert.AreEqual(1, broken.Nearest(default(Vec3), Unscaled, ref least));
            Assert.Throws<ArgumentException>(() => new SurfaceTriangles(new float[0], new int[257][]));
        }

        [Test]
        public void TheLargestSurfaceIsFirstAndPartsOfOneMaterialAreOne()
        {
            float[] square = Numbers(new Vec3(0, 0, 0), new Vec3(2, 0, 0), new Vec3(2, 0, 3), new Vec3(0, 0, 3));
            Assert.AreEqual(6.0, SurfaceTriangles.Area(square, new[] { 0, 1, 2, 0, 2, 3 }), 1e-6);
            object oak = new object(), steel = new object(), felt = new object();
            var order = new SurfaceOrder();
            order.Grow(order.SlotOf(steel), 2.0);
            order.Grow(order.SlotOf(oak), 1.5);
            order.Grow(order.SlotOf(felt), 2.0);
            order.Grow(order.SlotOf(oak), 1.5);
            List<int> slots = order.LargestFirst(2);
            Assert.AreEqual(3, order.Count);
            Assert.AreSame(oak, order.MaterialOf(slots[0]));
            Assert.AreSame(steel, order.MaterialOf(slots[1])); // as large as felt, and before it
            Assert.AreEqual(2, slots.Count);
        }

        [Test]
        public void AnOlderServiceGetsTheNameOfTheLargestSurfaceInTheNameOfTheObject()
        {
            var registry = new SceneRegistry();
            var surfaces = new List<ObjectSurface> { new ObjectSurface { Name = "Oak" }, new ObjectSurface { Name = "Steel" } };
            registry.Put(new SceneObject { ObjectId = "o", Name = "Bar/Table", Surfaces = surfaces });
            Assert.AreEqual("Bar/Oak Table", Written(registry, false).Name);
            Assert.IsNull(Written(registry, false).Surfaces);
            Assert.AreEqual("Bar/Table", Written(registry, true).Name);
            Assert.AreEqual(2, Written(registry, true).Surfaces.Count);
        }

        [TestCase(1, null), TestCase(2, 3L), TestCase(7, 3L)]
        public void ATouchNamesItsSurfaceToAServiceThatKnowsSurfaces(int minor, long? expected)
        {
            var outbox = new Outbox();
            outbox.Restart(new Welcome { Protocol = new ProtocolVersion { Major = 1, Minor = minor } });
            outbox.Next(0.0); // the scene
            var touch = new Touch { Phase = Phase.Contact, Hand = HandName.Left, ObjectId = "o", Surface = 3 };
            outbox.Touches.Add(ref touch);
            var reader = new MsgPackReader(outbox.Next(0.0).Written);
            Assert.AreEqual(expected, Touch.Read(ref reader, new StringPool()).Surface);
        }

        [Test]
        public void TheSurfacesOfAnObjectAreLimitedAsTheProtocolIs()
        {
            var surfaces = new List<ObjectSurface>();
            for (int i = 0; i < 100; i++) surfaces.Add(new ObjectSurface { Name = new string('x', 300) });
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "o", Surfaces = surfaces });
            List<ObjectSurface> written = Written(registry, true).Surfaces;
            Assert.AreEqual(64, written.Count);
            Assert.AreEqual(256, written[0].Name.Length);
        }

        [Test]
        public void TheTextureOfASurfaceIsStatedWhenItIsKnown()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "o", Surfaces = new List<ObjectSurface> { new ObjectSurface(), new ObjectSurface { Name = "mat14" } } });
            Written(registry, true);
            string hash = new string('a', 32);
            registry.SetTexture("o", 1, hash);
            registry.SetTexture("o", 2, hash);
            registry.SetTexture("unknown", 0, hash);
            var writer = new MsgPackWriter();
            Assert.IsTrue(registry.Write(writer, new RequestIds()));
            var reader = new MsgPackReader(writer.Written);
            Assert.AreEqual(hash, Scene.Read(ref reader, new StringPool()).Objects[0].Surfaces[1].Texture);
            Assert.IsFalse(registry.Write(writer, new RequestIds()));
        }

        static SceneObject Written(SceneRegistry registry, bool knowsSurfaces)
        {
            registry.Restart(new List<string>(), knowsSurfaces);
            var writer = new MsgPackWriter();
            Assert.IsTrue(registry.Write(writer, new RequestIds()));
            var reader = new MsgPackReader(writer.Written);
            return Scene.Read(ref reader, new StringPool()).Objects[0];
        }
    }
}
