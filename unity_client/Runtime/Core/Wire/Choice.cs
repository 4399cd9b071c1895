namespace HapticVLM.Wire
{
    /// <summary>Reads and writes an enum whose first member is Other: a value this version does not know.</summary>
    internal static class Choice
    {
        /// <summary>Index of the next string in texts, counted from 1; 0 when it is none of them.</summary>
        public static int Read(ref MsgPackReader r, byte[][] texts)
        {
            for (int i = 0; i < texts.Length; i++)
            {
                if (r.TryKey(texts[i])) return i + 1;
            }
            if (r.Peek() != MsgPackType.Str) throw new WireException("string expected");
            r.Skip();
            return 0;
        }

        public static void Write(MsgPackWriter w, byte[][] texts, int value, string name)
        {
            if (value < 1 || value > texts.Length) throw new WireException(name + " is not set");
            w.Raw(texts[value - 1]);
        }
    }
}
