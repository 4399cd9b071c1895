using System;
using System.Text;

namespace HapticVLM.Wire
{
    /// <summary>Makes any string of a scene valid for the protocol.</summary>
    public static class WireText
    {
        const char Replacement = '\uFFFD';

        /// <summary>
        /// Truncates the text to this many characters without splitting a surrogate pair, and replaces
        /// unpaired surrogates. Returns the same instance if nothing changes; null stays null.
        /// </summary>
        public static string Within(string text, int length)
        {
            if (text == null) return null;
            int end = Math.Min(text.Length, length);
            if (end < text.Length && end > 0 && char.IsHighSurrogate(text[end - 1])) end--;
            string cut = end == text.Length ? text : text.Substring(0, end);
            return IsWellFormed(cut) ? cut : Repaired(cut);
        }

        /// <summary>Like Within, but keeps the end of the text.</summary>
        public static string End(string text, int length)
        {
            if (text == null || text.Length <= length) return Within(text, length);
            int start = text.Length - length;
            if (char.IsLowSurrogate(text[start])) start++;
            return Within(text.Substring(start), length);
        }

        static bool IsWellFormed(string text)
        {
            for (int i = 0; i < text.Length; i++)
            {
                if (!char.IsSurrogate(text[i])) continue;
                if (!IsPair(text, i)) return false;
                i++;
            }
            return true;
        }

        static string Repaired(string text)
        {
            var result = new StringBuilder(text.Length);
            for (int i = 0; i < text.Length; i++)
            {
                if (IsPair(text, i)) result.Append(text[i]).Append(text[++i]);
                else result.Append(char.IsSurrogate(text[i]) ? Replacement : text[i]);
            }
            return result.ToString();
        }

        static bool IsPair(string text, int at)
        {
            return at + 1 < text.Length && char.IsSurrogatePair(text[at], text[at + 1]);
        }
    }
}
