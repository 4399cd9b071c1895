using System;
using System.Text;

namespace HapticVLM.Wire
{
    /// <summary>
    /// Writes MessagePack into its own buffer, which never shrinks: writing allocates nothing once the
    /// buffer fits the largest message. Integers and lengths use their shortest form. Extension types
    /// are not supported. Not thread-safe.
    /// </summary>
    public sealed class MsgPackWriter
    {
        internal static readonly UTF8Encoding Utf8 = new UTF8Encoding(false, true);

        byte[] buffer;
        int length;

        public MsgPackWriter(int capacity = 256)
        {
            buffer = new byte[Math.Max(16, capacity)];
        }

        /// <summary>Bytes written since the last Reset.</summary>
        public int Length { get { return length; } }

        /// <summary>The bytes written since the last Reset; valid until the next call.</summary>
        public ArraySegment<byte> Written { get { return new ArraySegment<byte>(buffer, 0, length); } }

        public void Reset()
        {
            length = 0;
        }

        public void Nil()
        {
            Tag(0xc0);
        }

        public void Bool(bool value)
        {
            Tag(value ? (byte)0xc3 : (byte)0xc2);
        }

        public void Int(long value)
        {
            if (value >= 0) UInt((ulong)value);
            else if (value >= -32) Tag((byte)value);
            else if (value >= sbyte.MinValue) Tagged(0xd0, (ulong)value, 1);
            else if (value >= short.MinValue) Tagged(0xd1, (ulong)value, 2);
            else if (value >= int.MinValue) Tagged(0xd2, (ulong)value, 4);
            else Tagged(0xd3, (ulong)value, 8);
        }

        public void UInt(ulong value)
        {
            if (value < 0x80) Tag((byte)value);
            else if (value <= byte.MaxValue) Tagged(0xcc, value, 1);
            else if (value <= ushort.MaxValue) Tagged(0xcd, value, 2);
            else if (value <= uint.MaxValue) Tagged(0xce, value, 4);
            else Tagged(0xcf, value, 8);
        }

        public void Float(float value)
        {
            var bits = default(Float32Bits);
            bits.Value = value;
            Tagged(0xca, bits.Bits, 4);
        }

        public void Double(double value)
        {
            Tagged(0xcb, (ulong)BitConverter.DoubleToInt64Bits(value), 8);
        }

        /// <summary>Writes a string as UTF-8; throws WireException on an unpaired surrogate.</summary>
        public void Str(string value)
        {
            try
            {
                int count = Utf8.GetByteCount(value);
                if (count < 32) Tag((byte)(0xa0 | count));
                else Header(0xd9, 0xda, 0xdb, count);
                Reserve(count);
                length += Utf8.GetBytes(value, 0, value.Length, buffer, length);
            }
            catch (EncoderFallbackException error)
            {
                throw new WireException("a string is not valid Unicode", error);
            }
        }

        public void Bin(ArraySegment<byte> value)
        {
            Header(0xc4, 0xc5, 0xc6, value.Count);
            Reserve(value.Count);
            if (value.Count > 0) Buffer.BlockCopy(value.Array, value.Offset, buffer, length, value.Count);
            length += value.Count;
        }

        public void ArrayHeader(int count)
        {
            if (count < 16) Tag((byte)(0x90 | count));
            else if (count <= ushort.MaxValue) Tagged(0xdc, (ulong)count, 2);
            else Tagged(0xdd, (ulong)count, 4);
        }

        public void MapHeader(int count)
        {
            if (count < 16) Tag((byte)(0x80 | count));
            else if (count <= ushort.MaxValue) Tagged(0xde, (ulong)count, 2);
            else Tagged(0xdf, (ulong)count, 4);
        }

        /// <summary>Appends bytes that are already MessagePack, such as a key from Encoded.</summary>
        public void Raw(byte[] encoded)
        {
            Reserve(encoded.Length);
            Buffer.BlockCopy(encoded, 0, buffer, length, encoded.Length);
            length += encoded.Length;
        }

        /// <summary>Encodes a string once, to be written with Raw or compared with TryKey.</summary>
        public static byte[] Encoded(string text)
        {
            var writer = new MsgPackWriter(text.Length * 3 + 5);
            writer.Str(text);
            var bytes = new byte[writer.length];
            Buffer.BlockCopy(writer.buffer, 0, bytes, 0, bytes.Length);
            return bytes;
        }

        void Header(byte tag8, byte tag16, byte tag32, int count)
        {
            if (count <= byte.MaxValue) Tagged(tag8, (ulong)count, 1);
            else if (count <= ushort.MaxValue) Tagged(tag16, (ulong)count, 2);
            else Tagged(tag32, (ulong)count, 4);
        }

        void Tag(byte tag)
        {
            Reserve(1);
            buffer[length++] = tag;
        }

        void Tagged(byte tag, ulong value, int bytes)
        {
            Reserve(1 + bytes);
            buffer[length++] = tag;
            for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) buffer[length++] = (byte)(value >> shift);
        }

        void Reserve(int bytes)
        {
            if (length + bytes <= buffer.Length) return;
            Array.Resize(ref buffer, Math.Max(buffer.Length * 2, length + bytes));
        }
    }
}
