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
            if (at >= text.Length || text[at] != '"') throw Wrong();
            int end = ++at;
            while (end < text.Length && text[end] != '"' && text[end] != '\\') end++;
            if (end < text.Length && text[end] == '"')
            {
                string plain = text.Substring(at, end - at);
                at = end + 1;
                return plain;
            }
            return Escaped();
        }

        private string Escaped()
        {
            var built = new StringBuilder();
            for (; at < text.Length && text[at] != '"'; at++)
            {
                if (text[at] != '\\')
                {
                    built.Append(text[at]);
                    continue;
                }
                if (++at >= text.Length) throw Wrong();
                int plain = "\"\\/bfnrt".IndexOf(text[at]);
                if (plain >= 0) built.Append("\"\\/\b\f\n\r\t"[plain]);
                else
                {
                    ushort code = 0;
                    bool isCode = text[at] == 'u' && at + 4 < text.Length && ushort.TryParse(text.Substring(at + 1, 4), NumberStyles.AllowHexSpecifier, CultureInfo.InvariantCulture, out code);
                    if (!isCode) throw Wrong();
                    built.Append((char)code);
                    at += 4;
                }
            }
            if (at++ >= text.Length) throw Wrong();
            return built.ToString();
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
