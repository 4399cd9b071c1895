using System;

namespace HapticVLM.Wire
{
    /// <summary>
    /// Gives the same string for the same UTF-8 bytes, so that what the service says again and again
    /// is allocated once. Bounded: long strings are not kept, and a full pool starts afresh.
    /// </summary>
    public sealed class StringPool
    {
        const int LongestKept = 64;
        const int Slots = 1024;
        const int MostKept = Slots / 2;

        readonly string[] texts = new string[Slots];
        readonly byte[][] keys = new byte[Slots][];
        int kept;

        /// <summary>Throws DecoderFallbackException when the bytes are not UTF-8.</summary>
        public string Get(byte[] data, int offset, int count)
        {
            if (count == 0) return "";
            if (count > LongestKept) return MsgPackWriter.Utf8.GetString(data, offset, count);
            int slot = Find(data, offset, count);
            return texts[slot] ?? Keep(slot, data, offset, count);
        }

        string Keep(int slot, byte[] data, int offset, int count)
        {
            string text = MsgPackWriter.Utf8.GetString(data, offset, count);
            if (kept == MostKept)
            {
                Array.Clear(texts, 0, Slots);
                kept = 0;
                slot = Find(data, offset, count);
            }
            var key = new byte[count];
            Buffer.BlockCopy(data, offset, key, 0, count);
            keys[slot] = key;
            texts[slot] = text;
            kept++;
            return text;
        }

        /// <summary>The slot that holds these bytes, or the free one where they belong.</summary>
        int Find(byte[] data, int offset, int count)
        {
            uint hash = 2166136261; // FNV-1a
            for (int i = 0; i < count; i++) hash = (hash ^ data[offset + i]) * 16777619;
            int slot = (int)(hash % Slots);
            while (texts[slot] != null && !Holds(keys[slot], data, offset, count)) slot = (slot + 1) % Slots;
            return slot;
        }

        static bool Holds(byte[] key, byte[] data, int offset, int count)
        {
            if (key.Length != count) return false;
            for (int i = 0; i < count; i++)
            {
                if (key[i] != data[offset + i]) return false;
            }
            return true;
        }
    }
}
