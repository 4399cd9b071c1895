using System;
using System.Collections.Generic;

namespace HapticVLM.Baked
{
    /// <summary>Reads a value of a file. `field` is its path, which a FormatException begins with.</summary>
    internal delegate T Reader<T>(string field, object value);

    /// <summary>One map of a file; every reading names the field that is missing, of another kind or beyond its limits.</summary>
    internal sealed class Table
    {
        private readonly string path;
        private readonly Dictionary<string, object> fields;

        public Table(string path, object value)
        {
            this.path = path;
            fields = Read.As<Dictionary<string, object>>(path, value);
        }

        public T Get<T>(string name, Reader<T> read)
        {
            string field = path.Length == 0 ? name : path + "." + name;
            object value;
            return fields.TryGetValue(name, out value) ? read(field, value) : throw Read.Wrong(field, "is missing");
        }

        public T Get<T>(string name, Reader<T> read, T missing)
        {
            object value;
            return fields.TryGetValue(name, out value) && value != null ? Get(name, read) : missing;
        }
    }

    /// <summary>Readers of the values of a file.</summary>
    internal static class Read
    {
        public static FormatException Wrong(string field, string why)
        {
            return new FormatException((field.Length == 0 ? "the file" : field) + ": " + why + "; bake it again");
        }

        public static T As<T>(string field, object value)
        {
            return value is T ? (T)value : throw Wrong(field, value == null ? "is null" : "is of another kind");
        }

        /// <summary>Returns the reader of a name that a map of the file must have.</summary>
        public static Reader<string> NameIn(Table file, string kind)
        {
            return (field, value) =>
            {
                string name = As<string>(field, value);
                return file.Get(kind, As<Dictionary<string, object>>).ContainsKey(name) ? name : throw Wrong(field, kind + " has no '" + name + "'");
            };
        }

        /// <summary>Returns the reader of base64 that has so many bytes at least.</summary>
        public static Reader<byte[]> Bytes(int least)
        {
            return (field, value) =>
            {
                try
                {
                    byte[] bytes = Convert.FromBase64String(As<string>(field, value));
                    if (bytes.Length >= least) return bytes;
                }
                catch (FormatException) when (value is string)
                {
                }
                throw Wrong(field, "is not base64, or too short");
            };
        }

        public static Reader<double[]> Rising(Reader<double[]> read)
        {
            return (field, value) =>
            {
                double[] axis = read(field, value);
                for (int at = 1; at < axis.Length; at++)
                {
                    if (axis[at] <= axis[at - 1]) throw Wrong(field, "does not rise");
                }
                return axis;
            };
        }

        public static Reader<double> Number(double low = -1e9, double high = 1e9)
        {
            return (field, value) =>
            {
                double number = As<double>(field, value);
                return number >= low && number <= high ? number : throw Wrong(field, number + " is not " + low + " to " + high);
            };
        }

        public static Reader<int> Whole(double low, double high)
        {
            Reader<double> read = Number(low, high);
            return (field, value) =>
            {
                double number = read(field, value);
                return number == Math.Floor(number) ? (int)number : throw Wrong(field, number + " is not a whole number");
            };
        }

        public static Reader<T> Part<T>(Func<Table, T> read)
        {
            return (field, value) => read(new Table(field, value));
        }

        public static Reader<T?> Maybe<T>(Reader<T> read)
            where T : struct
        {
            return (field, value) => value == null ? (T?)null : read(field, value);
        }

        public static Reader<T> OrNull<T>(Reader<T> read)
            where T : class
        {
            return (field, value) => value == null ? null : read(field, value);
        }

        public static Reader<T[]> List<T>(Reader<T> read, int least = 0, int most = int.MaxValue)
        {
            return (field, value) =>
            {
                List<object> list = As<List<object>>(field, value);
                if (list.Count < least || list.Count > most) throw Wrong(field, "has " + list.Count + " entries, not " + least + " or more");
                int at = 0;
                return list.ConvertAll(each => read(field + "." + at++, each)).ToArray();
            };
        }

        /// <summary>Returns the reader of a map, which must have these names.</summary>
        public static Reader<Dictionary<string, T>> Map<T>(Reader<T> read, params string[] names)
        {
            return (field, value) =>
            {
                var map = new Dictionary<string, T>();
                var table = new Table(field, value);
                foreach (string name in names) table.Get(name, Read.As<object>);
                foreach (KeyValuePair<string, object> each in As<Dictionary<string, object>>(field, value)) map[each.Key] = read(field + "." + each.Key, each.Value);
                return map;
            };
        }
    }
}
