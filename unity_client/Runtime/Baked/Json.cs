using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace HapticVLM.Baked
{
    /// <summary>Reads JSON into maps, lists, strings, doubles, booleans and null; enough for the files of a bake.</summary>
    internal sealed class Json
    {
        private const int Deepest = 32;
        private static readonly char[] Ends = { '"', '\\' };
        private readonly string text;
        private int at;

        private Json(string text)
        {
            this.text = text ?? "";
        }

        /// <summary>Throws FormatException where the text is not one JSON value.</summary>
        public static object Parse(string text)
        {
            var json = new Json(text);
            object value = json.Value(0);
            json.Skip();
            if (json.at < text.Length) throw json.Wrong();
            return value;
        }

        private object Value(int depth)
        {
            if (depth > Deepest) throw Wrong();
            switch (Peek())
            {
                case '{': return Map(depth);
                case '[': return List(depth);
                case '"': return String();
                case 't': return Word("true", true);
                case 'f': return Word("false", false);
                case 'n': return Word("null", null);
                default: return Number();
            }
        }

        private Dictionary<string, object> Map(int depth)
        {
            var map = new Dictionary<string, object>();
            at++;
            if (Taken('}')) return map;
            do
            {
                Peek();
                string key = String();
                if (!Taken(':')) throw Wrong();
                map[key] = Value(depth + 1);
            }
            while (Taken(','));
            if (!Taken('}')) throw Wrong();
            return map;
        }

        private List<object> List(int depth)
        {
            var list = new List<object>();
            at++;
            if (Taken(']')) return list;
            do list.Add(Value(depth + 1));
            while (Taken(','));
            if (!Taken(']')) throw Wrong();
            return list;
        }

        private string String()
        {
            if (at >= text.Length || text[at++] != '"') throw Wrong();
            var built = new StringBuilder();
            while (true)
            {
                int end = text.IndexOfAny(Ends, at);
                if (end < 0) throw Wrong();
                built.Append(text, at, end - at);
                at = end + 1;
                if (text[end] == '"') return built.ToString();
                built.Append(Escape());
            }
        }

        private char Escape()
        {
            int plain = at < text.Length ? "\"\\/bfnrt".IndexOf(text[at]) : -1;
            ushort code = 0;
            bool isCode = at + 5 <= text.Length && text[at] == 'u' && ushort.TryParse(text.Substring(at + 1, 4), NumberStyles.AllowHexSpecifier, CultureInfo.InvariantCulture, out code);
            if (plain < 0 && !isCode) throw Wrong();
            at += isCode ? 5 : 1;
            return isCode ? (char)code : "\"\\/\b\f\n\r\t"[plain];
        }

        private object Number()
        {
            int begin = at;
            while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0) at++;
            double number;
            if (!double.TryParse(text.Substring(begin, at - begin), NumberStyles.Float, CultureInfo.InvariantCulture, out number)) throw Wrong();
            return number;
        }

        private object Word(string word, object value)
        {
            if (string.CompareOrdinal(text, at, word, 0, word.Length) != 0) throw Wrong();
            at += word.Length;
            return value;
        }

        private char Peek()
        {
            Skip();
            if (at >= text.Length) throw Wrong();
            return text[at];
        }

        private bool Taken(char letter)
        {
            Skip();
            bool taken = at < text.Length && text[at] == letter;
            if (taken) at++;
            return taken;
        }

        private void Skip()
        {
            while (at < text.Length && " \t\r\n".IndexOf(text[at]) >= 0) at++;
        }

        private FormatException Wrong()
        {
            return new FormatException("not JSON at character " + at + "; bake the file again");
        }
    }
}
