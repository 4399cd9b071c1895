namespace HapticVLM.Wire
{
    /// <summary>Reads and writes an enum whose first member, Other, stands for values unknown to this version.</summary>
    internal static class Choice
    {
        /// <summary>Reads a string and returns its index in texts, counted from 1; 0 if it is not in the list.</summary>
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
