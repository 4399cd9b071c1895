using System;
using System.Collections.Generic;
using System.Text;
using HapticVLM.Wire;

namespace HapticVLM.Editor
{
    /// <summary>The open scene as the `scene` messages that it sends when it plays, in JSON, for `hapticvlm bake`.</summary>
    internal static class SceneExport
    {
        static readonly StringPool Pool = new StringPool();

        /// <summary>Returns a list of messages. An object without an id of its own gets one, because the bake is found by it.</summary>
        public static string Messages(List<HapticObject> objects, HapticClient client)
        {
            var registry = new SceneRegistry();
            var ids = new HashSet<string>();
            foreach (HapticObject shown in objects)
            {
                if (string.IsNullOrEmpty(shown.ObjectId) || !ids.Add(shown.ObjectId))
                {
                    Persisted.Change(shown, "Renew id", shown.RenewId); // a duplicated object has the id of its original
                    ids.Add(shown.ObjectId);
                }
            }
            foreach (HapticObject shown in objects) registry.Put(shown.Describe());
            if (client != null) client.Describe(registry);
            registry.Restart(new List<string>(), true);
            var text = new StringBuilder("[");
            var writer = new MsgPackWriter();
            for (var requests = new RequestIds(); registry.Write(writer, requests); writer.Reset())
            {
                if (text.Length > 1) text.Append(",\n");
                var reader = new MsgPackReader(writer.Written);
                Append(ref reader, text);
            }
            return text.Append("]\n").ToString();
        }

        static void Append(ref MsgPackReader reader, StringBuilder text)
        {
            switch (reader.Peek())
            {
                case MsgPackType.Map: AppendMap(ref reader, text); break;
                case MsgPackType.Array: AppendList(ref reader, text); break;
                case MsgPackType.Str: JsonText.Append(reader.Str(Pool), text); break;
                case MsgPackType.Bool: JsonText.Append(reader.Bool(), text); break;
                case MsgPackType.Int:
                case MsgPackType.Float: JsonText.Append(reader.Double(), text); break;
                default: throw new InvalidOperationException("a scene message has no " + reader.Peek());
            }
        }

        static void AppendMap(ref MsgPackReader reader, StringBuilder text)
        {
            text.Append('{');
            for (int left = reader.MapHeader(), all = left; left > 0; left--)
            {
                if (left < all) text.Append(", ");
                Append(ref reader, text);
                text.Append(": ");
                Append(ref reader, text);
            }
            text.Append('}');
        }

        static void AppendList(ref MsgPackReader reader, StringBuilder text)
        {
            text.Append('[');
            for (int left = reader.ArrayHeader(), all = left; left > 0; left--)
            {
                if (left < all) text.Append(", ");
                Append(ref reader, text);
            }
            text.Append(']');
        }
    }
}
