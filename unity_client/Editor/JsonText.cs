using System;
using System.Collections.Generic;
using System.Globalization;
using System.Text;

namespace HapticVLM.Editor
{
    /// <summary>Writes maps, lists, strings, doubles, booleans and null as JSON.</summary>
    internal static class JsonText
    {
        public static string Of(object value)
        {
            var text = new StringBuilder();
            Append(value, text, 0);
            return text.Append('\n').ToString();
        }

        static void Append(object value, StringBuilder text, int depth)
        {
            var map = value as Dictionary<string, object>;
            var list = value as List<object>;
            if (map != null) AppendMap(map, text, depth);
            else if (list != null) AppendList(list, text, depth);
            else if (value == null) text.Append("null");
            else if (value is bool) text.Append((bool)value ? "true" : "false");
            else if (value is double) text.Append(((double)value).ToString("r", CultureInfo.InvariantCulture));
            else AppendString((string)value, text);
        }

        static void AppendMap(Dictionary<string, object> map, StringBuilder text, int depth)
        {
            text.Append('{');
            int count = 0;
            foreach (KeyValuePair<string, object> each in map)
            {
                if (count++ > 0) text.Append(',');
                Break(text, depth + 1);
                AppendString(each.Key, text);
                text.Append(": ");
                Append(each.Value, text, depth + 1);
            }
            if (count > 0) Break(text, depth);
            text.Append('}');
        }

        static void AppendList(List<object> list, StringBuilder text, int depth)
        {
            text.Append('[');
            for (int i = 0; i < list.Count; i++)
            {
                if (i > 0) text.Append(',');
                Break(text, depth + 1);
                Append(list[i], text, depth + 1);
            }
            if (list.Count > 0) Break(text, depth);
            text.Append(']');
        }

        static void Break(StringBuilder text, int depth)
        {
            text.Append('\n').Append(' ', depth);
        }

        static void AppendString(string value, StringBuilder text)
        {
            text.Append('"');
            foreach (char letter in value)
            {
                if (letter == '"' || letter == '\\') text.Append('\\').Append(letter);
                else if (letter < ' ') text.Append("\\u").Append(((int)letter).ToString("x4"));
                else text.Append(letter);
            }
            text.Append('"');
        }
    }
}
