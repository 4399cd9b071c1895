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
        public void RenewalsGiveWayAndContactsAndReleasesNever()
        {
            var random = new Random(1);
            var ring = new TouchRing(8);
            var kept = new List<Phase>();
            for (int i = 0; i < 10000; i++)
            {
                var phase = (Phase)random.Next(1, 5);
                bool isKept = Add(ring, phase, random.Next(2) == 0 ? HandName.Left : HandName.Right, "a");
                bool counts = phase == Phase.Contact || phase == Phase.Release;
                if (counts && isKept) kept.Add(phase);
                if (i % 6 == 5) AssertAllThere(kept, Drained(ring));
            }
        }

        static void AssertAllThere(List<Phase> kept, List<Phase> got)
        {
            got.RemoveAll(phase => phase == Phase.Approach || phase == Phase.Slide);
            CollectionAssert.AreEqual(kept, got);
            kept.Clear();
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
        public void WaitsDoubleWithJitterUpToTheLongest()
        {
            var backoff = new Backoff(0.25, 8.0, 1);
            double most = 0.25;
            for (int i = 0; i < 20; i++)
            {
                Assert.That(backoff.Next(), Is.InRange(most / 2.0, most));
                most = Math.Min(8.0, most * 2.0);
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
            var found = new List<int>();
            ArraySegment<byte> message;
            Kind kind;
            while (inbox.Take(out message, out kind)) found.Add(message.Array[message.Offset]);
            return found;
        }

        static Scene Told(SceneBook book)
        {
            var writer = new MsgPackWriter();
            Assert.IsTrue(book.Write(writer, new RequestIds()));
            var reader = new MsgPackReader(writer.Written);
            return Scene.Read(ref reader, new StringPool());
        }

        [Test]
        public void TheSceneIsToldWholeThenByChangesAndWholeAgainToANewService()
        {
            var book = new SceneBook();
            book.Put(new SceneObject { ObjectId = "a" });
            book.Put(new SceneObject { ObjectId = "b" });
            Assert.IsTrue(Told(book).Replace);
            Assert.IsFalse(book.Write(new MsgPackWriter(), new RequestIds()));
            book.Put(new SceneObject { ObjectId = "c" });
            Scene change = Told(book);
            Assert.IsFalse(change.Replace);
            Assert.AreEqual("c", change.Objects[0].ObjectId);
            book.Restart(new List<string> { "wood" });
            Assert.AreEqual(3, Told(book).Objects.Count);
        }

        [Test]
        public void WhatIsGoneIsForgottenByItsIdAndNothingElseIsToldAnew()
        {
            var book = new SceneBook();
            foreach (string id in new[] { "a", "b", "c" }) book.Put(new SceneObject { ObjectId = id });
            Told(book);
            book.Remove("b");
            book.Remove("never there");
            Scene told = Told(book);
            Assert.IsFalse(told.Replace);
            Assert.AreEqual(0, told.Objects.Count);
            CollectionAssert.AreEqual(new[] { "b" }, told.Forget);
            Assert.IsFalse(book.Write(new MsgPackWriter(), new RequestIds()));
        }

        [Test]
        public void WhatIsGoneAndComesBackBetweenTwoMessagesIsTold()
        {
            var book = new SceneBook();
            book.Put(new SceneObject { ObjectId = "a" });
            Told(book);
            book.Remove("a");
            book.Put(new SceneObject { ObjectId = "a", Name = "again" });
            CollectionAssert.AreEqual(new[] { "a" }, Told(book).Forget);
            Assert.AreEqual("again", Told(book).Objects[0].Name);
            Assert.IsFalse(book.Write(new MsgPackWriter(), new RequestIds()));
        }

        [Test]
        public void AnObjectThatChangesOftenIsToldOnce()
        {
            var book = new SceneBook();
            Told(book);
            for (int i = 0; i < 5; i++) book.Put(new SceneObject { ObjectId = "a", Name = "name " + i });
            Scene told = Told(book);
            Assert.AreEqual(1, told.Objects.Count);
            Assert.AreEqual("name 4", told.Objects[0].Name);
        }

        [Test]
        public void AnUnknownMaterialDoesNotKeepTheOtherObjectsFromBeingTold()
        {
            var book = new SceneBook();
            book.Put(new SceneObject { ObjectId = "a", Material = "wodo" });
            book.Put(new SceneObject { ObjectId = "b", Material = "wood" });
            book.Restart(new List<string> { "wood" });
            Scene told = Told(book);
            Assert.IsNull(told.Objects.Find(one => one.ObjectId == "a").Material);
            Assert.AreEqual("wood", told.Objects.Find(one => one.ObjectId == "b").Material);
        }

        [Test]
        public void WhatTheSceneCanBeMadeOfIsToldOnceAndWithoutWordsTheServiceDoesNotKnow()
        {
            var book = new SceneBook();
            book.Put(new SceneObject { ObjectId = "a" });
            book.Restart(new List<string> { "wood", "glass" });
            Assert.IsNull(Told(book).Materials);
            book.SetMaterials(new[] { "glass", "wodo", "", "glass", "wood" });
            Assert.AreEqual("glass wood", string.Join(" ", Told(book).Materials.ToArray()));
            book.SetMaterials(new[] { "glass", "wodo", "", "glass", "wood" });
            Assert.IsFalse(book.Write(new MsgPackWriter(), new RequestIds()));
            book.SetMaterials(null);
            Assert.IsNull(Told(book).Materials);
        }

        [Test]
        public void ThreeThousandObjectsAreToldInPiecesThatAddUp()
        {
            var book = new SceneBook();
            for (int i = 0; i < 3000; i++) book.Put(new SceneObject { ObjectId = "object " + i });
            var told = new HashSet<string>();
            Scene first = Told(book);
            Assert.IsTrue(first.Replace);
            for (Scene next = first; ; next = Told(book))
            {
                Assert.IsTrue(next.Replace == ReferenceEquals(next.Objects, first.Objects));
                next.Objects.ForEach(one => told.Add(one.ObjectId));
                if (told.Count == 3000) return;
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
            requests.Answered(1, 0.1);
            Assert.IsTrue(requests.MaySendFrame(0.1));
            requests.Sent(3, Kind.Touch, 1.0);
            requests.Answered(3, 1.005);
            requests.Answered(3, 2.0);
            var trips = new double[8];
            Assert.AreEqual(1, requests.RoundTrips(trips));
            Assert.That(trips[0], Is.EqualTo(5.0).Within(1e-6));
        }
    }
}
