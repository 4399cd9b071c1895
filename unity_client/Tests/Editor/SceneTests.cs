using System.Collections.Generic;
using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    public class SceneTests
    {
        static Scene NextMessage(SceneRegistry registry)
        {
            var writer = new MsgPackWriter();
            Assert.IsTrue(registry.Write(writer, new RequestIds()));
            var reader = new MsgPackReader(writer.Written);
            return Scene.Read(ref reader, new StringPool());
        }

        [Test]
        public void TheSceneIsSentWholeThenByChangesAndWholeAgainToANewService()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "a" });
            registry.Put(new SceneObject { ObjectId = "b" });
            Assert.IsTrue(NextMessage(registry).Replace);
            Assert.IsFalse(registry.Write(new MsgPackWriter(), new RequestIds()));
            registry.Put(new SceneObject { ObjectId = "c" });
            Scene change = NextMessage(registry);
            Assert.IsFalse(change.Replace);
            Assert.AreEqual("c", change.Objects[0].ObjectId);
            registry.Restart(new List<string> { "wood" });
            Assert.AreEqual(3, NextMessage(registry).Objects.Count);
        }

        [Test]
        public void ARemovedObjectIsSentByItsIdAndNothingElseIsSentAgain()
        {
            var registry = new SceneRegistry();
            foreach (string id in new[] { "a", "b", "c" }) registry.Put(new SceneObject { ObjectId = id });
            NextMessage(registry);
            registry.Remove("b");
            registry.Remove("unknown");
            Scene scene = NextMessage(registry);
            Assert.IsFalse(scene.Replace);
            Assert.AreEqual(0, scene.Objects.Count);
            CollectionAssert.AreEqual(new[] { "b" }, scene.Forget);
            Assert.IsFalse(registry.Write(new MsgPackWriter(), new RequestIds()));
        }

        [Test]
        public void AnObjectRemovedAndAddedBetweenTwoMessagesIsSent()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "a" });
            NextMessage(registry);
            registry.Remove("a");
            registry.Put(new SceneObject { ObjectId = "a", Name = "again" });
            CollectionAssert.AreEqual(new[] { "a" }, NextMessage(registry).Forget);
            Assert.AreEqual("again", NextMessage(registry).Objects[0].Name);
            Assert.IsFalse(registry.Write(new MsgPackWriter(), new RequestIds()));
        }

        [Test]
        public void AnObjectThatChangesOftenIsSentOnce()
        {
            var registry = new SceneRegistry();
            NextMessage(registry);
            for (int i = 0; i < 5; i++) registry.Put(new SceneObject { ObjectId = "a", Name = "name " + i });
            Scene scene = NextMessage(registry);
            Assert.AreEqual(1, scene.Objects.Count);
            Assert.AreEqual("name 4", scene.Objects[0].Name);
        }

        [Test]
        public void AnUnknownMaterialDoesNotBlockTheOtherObjects()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "a", Material = "wodo" });
            registry.Put(new SceneObject { ObjectId = "b", Material = "wood" });
            registry.Restart(new List<string> { "wood" });
            Scene scene = NextMessage(registry);
            Assert.IsNull(scene.Objects.Find(one => one.ObjectId == "a").Material);
            Assert.AreEqual("wood", scene.Objects.Find(one => one.ObjectId == "b").Material);
        }

        [Test]
        public void TheMaterialsOfTheSceneAreSentOnceAndWithoutUnknownOnes()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "a" });
            registry.Restart(new List<string> { "wood", "glass" });
            Assert.IsNull(NextMessage(registry).Materials);
            registry.SetMaterials(new[] { "glass", "wodo", "", "glass", "wood" });
            Assert.AreEqual("glass wood", string.Join(" ", NextMessage(registry).Materials.ToArray()));
            registry.SetMaterials(new[] { "glass", "wodo", "", "glass", "wood" });
            Assert.IsFalse(registry.Write(new MsgPackWriter(), new RequestIds()));
            registry.SetMaterials(null);
            Assert.IsNull(NextMessage(registry).Materials);
        }

        [Test]
        public void ThreeThousandObjectsAreSentInPartsThatAddUp()
        {
            var registry = new SceneRegistry();
            for (int i = 0; i < 3000; i++) registry.Put(new SceneObject { ObjectId = "object " + i });
            var scene = new HashSet<string>();
            Scene first = NextMessage(registry);
            Assert.IsTrue(first.Replace);
            for (Scene next = first; ; next = NextMessage(registry))
            {
                Assert.IsTrue(next.Replace == ReferenceEquals(next.Objects, first.Objects));
                next.Objects.ForEach(one => scene.Add(one.ObjectId));
                if (scene.Count == 3000) return;
            }
        }

        [Test]
        public void ASceneOfLargeObjectsIsSentInMessagesOfAtMostOneMebibyte()
        {
            var registry = new SceneRegistry();
            var surfaces = new List<ObjectSurface>();
            for (int i = 0; i < 64; i++) surfaces.Add(new ObjectSurface { Name = new string('x', 250) });
            for (int i = 0; i < 200; i++) registry.Put(new SceneObject { ObjectId = "object " + i, Surfaces = surfaces });
            registry.Restart(new List<string>(), true);
            int objects = 0, messages = 0;
            var writer = new MsgPackWriter();
            for (; registry.Write(writer, new RequestIds()); messages++, writer.Reset())
            {
                Assert.Less(writer.Length, (1 << 20) + 1000);
                var reader = new MsgPackReader(writer.Written);
                objects += Scene.Read(ref reader, new StringPool()).Objects.Count;
            }
            Assert.AreEqual(200, objects);
            Assert.AreEqual(4, messages);
        }

        [Test]
        public void AnObjectThatCannotBeEncodedIsRefusedAndTheOthersAreSent()
        {
            var registry = new SceneRegistry();
            registry.Put(new SceneObject { ObjectId = "a" });
            Assert.Throws<WireException>(() => registry.Put(new SceneObject { ObjectId = "b", StandsOn = new List<string> { "\ud800" } }));
            Assert.AreEqual("a", NextMessage(registry).Objects[0].ObjectId);
        }
    }
}
