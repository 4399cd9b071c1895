using System;
using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    [TestFixture]
    public class HandTests
    {
        [TestCase(45), TestCase(60), TestCase(72), TestCase(90), TestCase(120)]
        public void AStrokeOfConstantSpeedIsMeasuredExactlyAtEveryFrameRate(int rate)
        {
            var motion = new MotionEstimator();
            for (int i = 0; i < rate; i++) motion.Add(new Vec3(i / (double)rate, 0.0, 0.0), 1.0 / rate);
            Assert.AreEqual(1.0, motion.SpeedMps, 0.001);
        }

        [Test]
        public void AJumpFasterThanAnyHandIsIgnored()
        {
            var motion = new MotionEstimator();
            motion.Restart(new Vec3(0.0, 0.0, 0.0));
            motion.Add(new Vec3(3.0, 0.0, 0.0), 1.0 / 72.0);
            Assert.AreEqual(0.0, motion.SpeedMps);
            motion.Add(new Vec3(3.01, 0.0, 0.0), 1.0 / 72.0);
            Assert.AreEqual(0.72, motion.SpeedMps, 0.001);
        }

        [Test]
        public void TheJitterOfATrackedHandAtRestIsSmoothedAway()
        {
            var random = new Random(1);
            var motion = new MotionEstimator();
            double sum = 0.0, raw = 0.0;
            var last = default(Vec3);
            for (int i = 0; i < 720; i++)
            {
                var at = new Vec3(random.NextDouble() * 0.001, 0.0, 0.0); // 1 mm of noise
                raw += (at - last).Length * 72.0;
                last = at;
                motion.Add(at, 1.0 / 72.0);
                sum += motion.SpeedMps;
            }
            Assert.Less(sum, 0.6 * raw);
        }

        [Test]
        public void AHandIsLeftOrRight()
        {
            Assert.Throws<ArgumentException>(() => new HandTouches(HandName.Other, 20.0));
        }

        [Test]
        public void TwoFingersOnOneColliderAreTwoContactsAndOneTouch()
        {
            var touches = new HandTouches(HandName.Left, 20.0);
            object index = new object(), thumb = new object(), mug = new object();
            touches.Begin(index, mug, "mug", 0.1, 0.0, null);
            touches.Begin(thumb, mug, "mug", 0.1, 0.0, null);
            Assert.AreEqual(2, touches.Count);
            touches.End(index, mug, null);
            Assert.AreEqual("mug", touches.ObjectId);
            touches.EndFinger(thumb, null);
            Assert.IsFalse(touches.IsTouching);
        }

        [TestCase("plain", 5, "plain"), TestCase("plain", 3, "pla"), TestCase("ab\ud83d\ude00", 3, "ab")]
        [TestCase("ab\ud83d\ude00", 4, "ab\ud83d\ude00"), TestCase("a\ud83d", 9, "a\ufffd"), TestCase("\ude00b", 9, "\ufffdb")]
        public void TextIsTruncatedWithoutBreakingACharacter(string text, int length, string expected)
        {
            Assert.AreEqual(expected, WireText.Within(text, length));
        }

        [Test]
        public void AnObjectWithoutAnIdIsRefused()
        {
            Assert.Throws<WireException>(() => new SceneRegistry().Put(default(SceneObject)));
        }
    }
}
