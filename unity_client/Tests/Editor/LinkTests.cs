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

        [Test]
        public void ATextureMapAndALiveFrameDoNotReplaceEachOtherOrWaitForEachOther()
        {
            var connection = new HapticConnection(new ConnectionSettings());
            foreach (FramePurpose purpose in new[] { FramePurpose.Texture, FramePurpose.Live })
            {
                var frame = new Frame { Format = FrameFormat.Jpeg, Origin = FrameOrigin.Top, Width = 1, Height = 1, Image = new ArraySegment<byte>(new byte[1]), Purpose = purpose };
                connection.Send(ref frame);
            }
            connection.Outbox.Requests.Sent(100, Kind.Frame, 0.0);
            Assert.AreEqual(FramePurpose.Live, PurposeOf(Sent(connection)));
            Assert.AreEqual(FramePurpose.Texture, PurposeOf(Sent(connection)), "it waits, though two live frames are unanswered");
            Assert.IsNull(Sent(connection));
        }

        static MsgPackWriter Sent(HapticConnection connection)
        {
            MsgPackWriter next = connection.Outbox.Next(0.0);
            long id;
            while (next != null && Protocol.KindOf(next.Written, out id) != Kind.Frame) next = connection.Outbox.Next(0.0);
            return next;
        }

        static FramePurpose? PurposeOf(MsgPackWriter message)
        {
            var reader = new MsgPackReader(message.Written);
            return Frame.Read(ref reader, new StringPool()).Purpose;
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
