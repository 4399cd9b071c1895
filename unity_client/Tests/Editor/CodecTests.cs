using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using NUnit.Framework;

namespace HapticVLM.Tests
{
    [TestFixture]
    public class CodecTests
    {
        static IEnumerable<TestCaseData> Integers()
        {
            foreach (long at in new[] { 0L, 1L << 7, 1L << 8, 1L << 15, 1L << 16, 1L << 31, 1L << 32, long.MaxValue - 1, -32L, -128L, -32768L, -(1L << 31), long.MinValue + 1 })
            {
                for (int near = -1; near <= 1; near++) yield return new TestCaseData(at + near);
            }
        }

        [TestCaseSource("Integers")]
        public void IntegersComeBackAcrossEveryLengthOfTheirEncoding(long value)
        {
            var writer = new MsgPackWriter();
            writer.Int(value);
            Assert.AreEqual(value, new MsgPackReader(writer.Written).Int());
        }

        [TestCase(127L, 1)]
        [TestCase(128L, 2)]
        [TestCase(255L, 2)]
        [TestCase(256L, 3)]
        [TestCase(65535L, 3)]
        [TestCase(65536L, 5)]
        [TestCase(4294967295L, 5)]
        [TestCase(4294967296L, 9)]
        [TestCase(-32L, 1)]
        [TestCase(-33L, 2)]
        [TestCase(-128L, 2)]
        [TestCase(-129L, 3)]
        [TestCase(-32769L, 5)]
        [TestCase(-2147483649L, 9)]
        public void IntegersTakeTheirShortestForm(long value, int length)
        {
            var writer = new MsgPackWriter();
            writer.Int(value);
            Assert.AreEqual(length, writer.Length);
        }

        [TestCase(0, 1)]
        [TestCase(31, 1)]
        [TestCase(32, 2)]
        [TestCase(255, 2)]
        [TestCase(256, 3)]
        [TestCase(65535, 3)]
        [TestCase(65536, 5)]
        public void StringsTakeTheShortestHeader(int length, int header)
        {
            var writer = new MsgPackWriter();
            writer.Str(new string('x', length));
            Assert.AreEqual(header + length, writer.Length);
            var reader = new MsgPackReader(writer.Written);
            Assert.AreEqual(length, reader.Str(new StringPool()).Length);
            Assert.IsTrue(reader.AtEnd);
        }

        [Test]
        public void AnUnpairedSurrogateIsRefused()
        {
            Assert.Throws<WireException>(() => new MsgPackWriter().Str("\ud83d"));
        }

        [Test]
        public void AThousandNestedArraysAreSkippedWithoutRecursion()
        {
            var bytes = new byte[100000];
            for (int i = 0; i < bytes.Length; i++) bytes[i] = 0x91;
            bytes[bytes.Length - 1] = 0xc0;
            var reader = new MsgPackReader(new ArraySegment<byte>(bytes));
            reader.Skip();
            Assert.IsTrue(reader.AtEnd);
        }

        [Test]
        public void ALengthBeyondTheMessageIsRefusedBeforeAnythingIsAllocated()
        {
            var reader = new MsgPackReader(new ArraySegment<byte>(new byte[] { 0xdf, 0xff, 0xff, 0xff, 0xff }));
            Assert.Throws<WireException>(() => reader.MapHeader());
        }

        [Test]
        public void AMissingRequiredFieldIsRefused()
        {
            var writer = new MsgPackWriter();
            writer.MapHeader(1);
            writer.Str("id");
            writer.Int(1);
            var reader = new MsgPackReader(writer.Written);
            Assert.Throws<WireException>(() => new Skipped().Read(ref reader, new StringPool()));
        }

        [Test]
        public void AnUnsetEnumIsNotSent()
        {
            Assert.Throws<WireException>(() => new Stop { Id = 1 }.Write(new MsgPackWriter()));
        }

        [Test]
        public void AMessageReadIntoAUsedInstanceLeavesNoTraceOfTheLast()
        {
            var refused = new Error { Code = ErrorCode.Limit, Text = "too fast", Path = "$.speed_mps" };
            var writer = new MsgPackWriter();
            new Error { Code = ErrorCode.Model, Text = "gone" }.Write(writer);
            var reader = new MsgPackReader(writer.Written);
            refused.Read(ref reader, new StringPool());
            Assert.AreEqual("gone", refused.Text);
            Assert.IsNull(refused.Path);
        }

        [Test]
        public void TheSameBytesGiveTheSameStringEvenAfterThePoolWasFull()
        {
            var pool = new StringPool();
            for (int i = 0; i < 5000; i++)
            {
                byte[] bytes = System.Text.Encoding.UTF8.GetBytes("object " + i);
                string first = pool.Get(bytes, 0, bytes.Length);
                Assert.AreEqual("object " + i, first);
                Assert.AreSame(first, pool.Get(bytes, 0, bytes.Length));
            }
        }
    }
}
