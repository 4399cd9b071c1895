using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    [TestFixture]
    public class LinkTests
    {
        static bool Add(TouchRing ring, Phase phase, HandName hand, string objectId)
        {
            var touch = new Touch { Phase = phase, Hand = hand, ObjectId = objectId };
            return ring.Add(ref touch);
        }

        static List<Phase> Drained(TouchRing ring)
        {
            var phases = new List<Phase>();
            Touch touch;
            while (ring.Take(out touch)) phases.Add(touch.Phase);
            return phases;
        }

        [Test]
        public void RenewalsAreDroppedAndContactsAndReleasesAreNot()
        {
            var random = new Random(1);
            var ring = new TouchRing(8);
            var queued = new List<Phase>();
            for (int i = 0; i < 10000; i++)
            {
                var phase = (Phase)random.Next(1, 5);
                bool isQueued = Add(ring, phase, random.Next(2) == 0 ? HandName.Left : HandName.Right, "a");
                bool counts = phase == Phase.Contact || phase == Phase.Release;
                if (counts && isQueued) queued.Add(phase);
                if (i % 6 == 5) AssertAllThere(queued, Drained(ring));
            }
        }

        static void AssertAllThere(List<Phase> queued, List<Phase> drained)
        {
            drained.RemoveAll(phase => phase == Phase.Approach || phase == Phase.Slide);
            CollectionAssert.AreEqual(queued, drained);
            queued.Clear();
        }

        [Test]
        public void ARingFullOfContactsRefusesInsteadOfDropping()
        {
            var ring = new TouchRing(4);
            for (int i = 0; i < 4; i++) Assert.IsTrue(Add(ring, Phase.Contact, HandName.Left, "a"));
            Assert.IsFalse(Add(ring, Phase.Release, HandName.Left, null));
            Assert.AreEqual(4, Drained(ring).Count);
        }

        [Test]
        public void ASlideIsNotMovedBeforeTheContactItFollows()
        {
            var ring = new TouchRing();
            Add(ring, Phase.Slide, HandName.Left, "a");
            Add(ring, Phase.Contact, HandName.Left, "b");
            Add(ring, Phase.Slide, HandName.Left, "b");
            Add(ring, Phase.Slide, HandName.Left, "c");
            CollectionAssert.AreEqual(new[] { Phase.Slide, Phase.Contact, Phase.Slide }, Drained(ring));
        }

        [Test]
        public void OnlyTheNewestFrameWaits()
        {
            var mailbox = new FrameMailbox();
            for (int i = 1; i <= 3; i++)
            {
                mailbox.Begin().Int(i);
                mailbox.Publish();
            }
            Assert.AreEqual(3, new MsgPackReader(mailbox.Take().Written).Int());
            Assert.IsNull(mailbox.Take());
            Assert.AreEqual(2, mailbox.Dropped);
        }

        [Test]
        public void WaitsDoubleWithJitterUpToTheLimit()
        {
            var backoff = new Backoff(0.25, 8.0, 1);
            double longest = 0.25;
            for (int i = 0; i < 20; i++)
            {
                Assert.That(backoff.Next(), Is.InRange(longest / 2.0, longest));
                longest = Math.Min(8.0, longest * 2.0);
            }
            backoff.Reset();
            Assert.That(backoff.Next(), Is.InRange(0.125, 0.25));
        }

        [Test]
        public void OfTelemetryOnlyTheNewestWaitsAndDecisionsKeepTheirOrder()
        {
            var inbox = new Inbox(4);
            inbox.Add(Bytes(1), Kind.Decision);
            inbox.Add(Bytes(2), Kind.Telemetry);
            inbox.Add(Bytes(3), Kind.Decision);
            inbox.Add(Bytes(4), Kind.Telemetry);
            CollectionAssert.AreEqual(new[] { 1, 4, 3 }, Taken(inbox));
            for (byte i = 0; i < 6; i++) inbox.Add(Bytes(i), Kind.Decision);
            CollectionAssert.AreEqual(new[] { 2, 3, 4, 5 }, Taken(inbox));
            Assert.AreEqual(2, inbox.Dropped);
        }

        static ArraySegment<byte> Bytes(byte value)
        {
            return new ArraySegment<byte>(new[] { value });
        }

        static List<int> Taken(Inbox inbox)
        {
            var kinds = new List<int>();
            ArraySegment<byte> message;
            Kind kind;
            while (inbox.Take(out message, out kind)) kinds.Add(message.Array[message.Offset]);
            return kinds;
        }

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
        public void UnansweredFramesHoldBackTheNextAndTouchesAreTimed()
        {
            var requests = new Requests();
            requests.Sent(1, Kind.Frame, 0.0);
            requests.Sent(2, Kind.Frame, 0.0);
            Assert.IsFalse(requests.MaySendFrame(0.1));
            Assert.IsTrue(requests.MaySendFrame(3.0), "a lost answer must not end the stream");
            requests.MatchAnswer(1, 0.1);
            Assert.IsTrue(requests.MaySendFrame(0.1));
            requests.Sent(3, Kind.Touch, 1.0);
            requests.MatchAnswer(3, 1.005);
            requests.MatchAnswer(3, 2.0);
            var trips = new double[8];
            Assert.AreEqual(1, requests.RoundTrips(trips));
            Assert.That(trips[0], Is.EqualTo(5.0).Within(1e-6));
        }
    }
}
