using System;
using System.Collections.Generic;
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
                Persisted.MakeIdUnique(shown, ids);
                ids.Add(shown.ObjectId);
            }
            foreach (HapticObject shown in objects) registry.Put(shown.Describe());
            if (client != null) client.Describe(registry);
            registry.Restart(new List<string>(), true);
            var messages = new List<object>();
            var writer = new MsgPackWriter();
            for (var requests = new RequestIds(); registry.Write(writer, requests); writer.Reset())
            {
                var reader = new MsgPackReader(writer.Written);
                messages.Add(Value(ref reader));
            }
            return JsonText.Of(messages);
        }

        static object Value(ref MsgPackReader reader)
        {
            switch (reader.Peek())
            {
                case MsgPackType.Map:
                    var map = new Dictionary<string, object>();
                    for (int left = reader.MapHeader(); left > 0; left--) map.Add(reader.Str(Pool), Value(ref reader));
                    return map;
                case MsgPackType.Array:
                    var list = new List<object>();
                    for (int left = reader.ArrayHeader(); left > 0; left--) list.Add(Value(ref reader));
                    return list;
                case MsgPackType.Str: return reader.Str(Pool);
                case MsgPackType.Bool: return reader.Bool();
                case MsgPackType.Int:
                case MsgPackType.Float: return reader.Double();
                default: throw new InvalidOperationException("a scene message has no " + reader.Peek());
            }
        }
    }
}
