using System;
using System.Text;

namespace HapticVLM.Wire
{
    public enum MsgPackType { Nil, Bool, Int, Float, Str, Bin, Array, Map, Ext }

    /// <summary>
    /// Reads MessagePack in place. For any input it throws only WireException, never reads outside the
    /// given bytes, allocates no more memory than they contain, and does not recurse.
    /// </summary>
    public struct MsgPackReader
    {
        readonly byte[] data;
        readonly int end;
        int at;

        public MsgPackReader(ArraySegment<byte> bytes)
        {
            data = bytes.Array;
            at = bytes.Offset;
            end = bytes.Offset + bytes.Count;
        }

        public bool AtEnd { get { return at >= end; } }

        public MsgPackType Peek()
        {
            Require(1);
            byte tag = data[at];
            if (tag < 0x80 || tag >= 0xe0) return MsgPackType.Int;
            if (tag < 0x90) return MsgPackType.Map;
            if (tag < 0xa0) return MsgPackType.Array;
            return tag < 0xc0 ? MsgPackType.Str : PeekLong(tag);
        }

        /// <summary>Consumes a nil if one is next.</summary>
        public bool TryNil()
        {
            Require(1);
            if (data[at] != 0xc0) return false;
            at++;
            return true;
        }

        /// <summary>Consumes the next value if it is the string with this encoding; never allocates.</summary>
        public bool TryKey(byte[] encoded)
        {
            if (encoded.Length > end - at) return false;
            for (int i = 0; i < encoded.Length; i++)
            {
                if (data[at + i] != encoded[i]) return false;
            }
            at += encoded.Length;
            return true;
        }

        public bool Bool()
        {
            ulong tag = Bytes(1);
            if (tag != 0xc2 && tag != 0xc3) throw new WireException("bool expected");
            return tag == 0xc3;
        }

        public long Int()
        {
            byte tag = (byte)Bytes(1);
            if (tag < 0x80 || tag >= 0xe0) return (sbyte)tag;
            switch (tag)
            {
                case 0xcc: return (long)Bytes(1);
                case 0xcd: return (long)Bytes(2);
                case 0xce: return (long)Bytes(4);
                case 0xcf: return Signed(Bytes(8));
                case 0xd0: return (sbyte)Bytes(1);
                case 0xd1: return (short)Bytes(2);
                case 0xd2: return (int)Bytes(4);
                case 0xd3: return (long)Bytes(8);
                default: throw new WireException("integer expected");
            }
        }

        /// <summary>A number of any kind, finite or not.</summary>
        public double Double()
        {
            Require(1);
            switch (data[at])
            {
                case 0xca:
                    at++;
                    var bits = default(Float32Bits);
                    bits.Bits = (uint)Bytes(4);
                    return bits.Value;
                case 0xcb:
                    at++;
                    return BitConverter.Int64BitsToDouble((long)Bytes(8));
                default:
                    return Int();
            }
        }

        /// <summary>Reads a string; the pool returns the same instance for the same bytes.</summary>
        public string Str(StringPool pool)
        {
            int count = StrLength();
            Require(count);
            try
            {
                string text = pool.Get(data, at, count);
                at += count;
                return text;
            }
            catch (DecoderFallbackException error)
            {
                throw new WireException("a string is not UTF-8", error);
            }
        }

        /// <summary>Reads bytes, as a view into the input.</summary>
        public ArraySegment<byte> Bin()
        {
            int count = BinLength();
            Require(count);
            var view = new ArraySegment<byte>(data, at, count);
            at += count;
            return view;
        }

        public int ArrayHeader()
        {
            byte tag = (byte)Bytes(1);
            if ((tag & 0xf0) == 0x90) return Count(tag & 15u, 1);
            if (tag == 0xdc) return Count(Bytes(2), 1);
            if (tag == 0xdd) return Count(Bytes(4), 1);
            throw new WireException("array expected");
        }

        public int MapHeader()
        {
            byte tag = (byte)Bytes(1);
            if ((tag & 0xf0) == 0x80) return Count(tag & 15u, 2);
            if (tag == 0xde) return Count(Bytes(2), 2);
            if (tag == 0xdf) return Count(Bytes(4), 2);
            throw new WireException("map expected");
        }

        /// <summary>Skips one value of any type and depth.</summary>
        public void Skip()
        {
            for (long left = 1; left > 0; left--)
            {
                switch (Peek())
                {
                    case MsgPackType.Nil: at++; break;
                    case MsgPackType.Bool: at++; break;
                    case MsgPackType.Int: Int(); break;
                    case MsgPackType.Float: Double(); break;
                    case MsgPackType.Str: Advance(StrLength()); break;
                    case MsgPackType.Bin: Advance(BinLength()); break;
                    case MsgPackType.Array: left += ArrayHeader(); break;
                    case MsgPackType.Map: left += 2L * MapHeader(); break;
                    default: Advance(1L + ExtLength()); break;
                }
            }
        }

        static MsgPackType PeekLong(byte tag)
        {
            if (tag == 0xc0) return MsgPackType.Nil;
            if (tag == 0xc1) throw new WireException("0xc1 is not a valid MessagePack tag");
            if (tag <= 0xc3) return MsgPackType.Bool;
            if (tag <= 0xc6) return MsgPackType.Bin;
            if (tag <= 0xc9) return MsgPackType.Ext;
            if (tag <= 0xcb) return MsgPackType.Float;
            if (tag <= 0xd3) return MsgPackType.Int;
            if (tag <= 0xd8) return MsgPackType.Ext;
            if (tag <= 0xdb) return MsgPackType.Str;
            return tag <= 0xdd ? MsgPackType.Array : MsgPackType.Map;
        }

        int StrLength()
        {
            byte tag = (byte)Bytes(1);
            if (tag >= 0xa0 && tag < 0xc0) return tag & 31;
            if (tag < 0xd9 || tag > 0xdb) throw new WireException("string expected");
            return Length(tag - 0xd9);
        }

        int BinLength()
        {
            byte tag = (byte)Bytes(1);
            if (tag < 0xc4 || tag > 0xc6) throw new WireException("bytes expected");
            return Length(tag - 0xc4);
        }

        int ExtLength()
        {
            byte tag = (byte)Bytes(1);
            return tag >= 0xd4 ? 1 << (tag - 0xd4) : Length(tag - 0xc7);
        }

        int Length(int power)
        {
            ulong count = Bytes(1 << power);
            if (count > int.MaxValue) throw new WireException("a length exceeds the message");
            return (int)count;
        }

        int Count(ulong count, int bytesEach)
        {
            if ((long)count * bytesEach > end - at) throw new WireException("a count exceeds the message");
            return (int)count;
        }

        static long Signed(ulong value)
        {
            if (value > long.MaxValue) throw new WireException("an integer exceeds 63 bits");
            return (long)value;
        }

        void Advance(long count)
        {
            Require(count);
            at += (int)count;
        }

        ulong Bytes(int count)
        {
            Require(count);
            ulong value = 0;
            for (int i = 0; i < count; i++) value = value << 8 | data[at++];
            return value;
        }

        void Require(long count)
        {
            if (count > end - at) throw new WireException("the message ends too early");
        }
    }
}
