using System;

namespace HapticVLM.Wire
{
    /// <summary>
    /// Returns the same string for the same UTF-8 bytes, so that repeated texts of the service are
    /// allocated once. The cache is bounded: long strings are not cached, and a full cache is cleared.
    /// </summary>
    public sealed class StringPool
    {
        const int MaxCachedLength = 64;
        const int Slots = 1024;
        const int MaxCached = Slots / 2;

        readonly string[] texts = new string[Slots];
        readonly byte[][] keys = new byte[Slots][];
        int cached;

        /// <summary>Returns the string; throws DecoderFallbackException when the bytes are not UTF-8.</summary>
        public string Get(byte[] data, int offset, int count)
        {
            if (count == 0) return "";
            if (count > MaxCachedLength) return MsgPackWriter.Utf8.GetString(data, offset, count);
            int slot = Find(data, offset, count);
            return texts[slot] ?? Cache(slot, data, offset, count);
        }

        string Cache(int slot, byte[] data, int offset, int count)
        {
            string text = MsgPackWriter.Utf8.GetString(data, offset, count);
            if (cached == MaxCached)
            {
                Array.Clear(texts, 0, Slots);
                cached = 0;
                slot = Find(data, offset, count);
            }
            var key = new byte[count];
            Buffer.BlockCopy(data, offset, key, 0, count);
            keys[slot] = key;
            texts[slot] = text;
            cached++;
            return text;
        }

        /// <summary>Returns the slot that holds these bytes, or the free slot for them.</summary>
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
