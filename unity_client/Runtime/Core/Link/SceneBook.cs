using System;
using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// What the scene consists of, and what of it the service was not told yet. Changes go out
    /// together; after a reconnect everything does. A material the service does not know is left out,
    /// because one such word would have it refuse the whole message. What is gone goes out as a list of
    /// ids in a message of its own, which a service of before refuses without losing anything else.
    /// </summary>
    public sealed class SceneBook
    {
        const int MostPerMessage = 1024; // 4096 are allowed, but 4 MiB are, too
        const int MostMaterials = 64; // as the schema of scene has it

        readonly object gate = new object();
        readonly Dictionary<string, SceneObject> objects = new Dictionary<string, SceneObject>();
        readonly List<string> changed = new List<string>(); // oldest first, each once
        readonly HashSet<string> isChanged = new HashSet<string>();
        readonly List<string> gone = new List<string>();
        readonly List<string> forgotten = new List<string>();
        readonly List<SceneObject> batch = new List<SceneObject>();
        readonly HashSet<string> materials = new HashSet<string>();
        readonly List<string> among = new List<string>();
        readonly List<string> admitted = new List<string>();
        double? ambientC;
        bool startsAfresh = true;

        public int Count { get { lock (gate) return objects.Count; } }

        /// <summary>Adds an object or changes it. Its texts are cut to what the wire allows.</summary>
        public void Put(SceneObject stated)
        {
            if (string.IsNullOrEmpty(stated.ObjectId)) throw new WireException("an object of the scene needs an id");
            stated.ObjectId = WireText.Within(stated.ObjectId, SceneObject.ObjectIdMaxLength);
            stated.Name = WireText.Within(stated.Name, SceneObject.NameMaxLength);
            stated.Material = WireText.Within(stated.Material, SceneObject.MaterialMaxLength);
            lock (gate)
            {
                objects[stated.ObjectId] = stated;
                if (!startsAfresh && isChanged.Add(stated.ObjectId)) changed.Add(stated.ObjectId);
            }
        }

        public void Remove(string objectId)
        {
            lock (gate)
            {
                if (objects.Remove(objectId) && !startsAfresh) gone.Add(objectId);
            }
        }

        /// <summary>The scene's own ambient temperature, degC; null when it does not say.</summary>
        public void SetAmbient(double? celsius)
        {
            lock (gate)
            {
                if (celsius != ambientC) startsAfresh = true;
                ambientC = celsius;
            }
        }

        /// <summary>All that the scene's objects can be made of; null or empty when it does not say.</summary>
        public void SetMaterials(IList<string> names)
        {
            lock (gate)
            {
                int count = names == null ? 0 : names.Count;
                bool same = count == among.Count;
                for (int i = 0; same && i < count; i++) same = names[i] == among[i];
                if (same) return;
                among.Clear();
                for (int i = 0; i < count; i++) among.Add(names[i]);
                startsAfresh = true;
            }
        }

        /// <summary>Tell everything again, to a service that knows these materials.</summary>
        public void Restart(List<string> known)
        {
            lock (gate)
            {
                materials.Clear();
                materials.UnionWith(known);
                startsAfresh = true;
            }
        }

        /// <summary>Whether the service knows this material; true before it said which it knows.</summary>
        public bool IsKnown(string material)
        {
            lock (gate) return material == null || materials.Count == 0 || materials.Contains(material);
        }

        /// <summary>Writes the next message if there is something to tell.</summary>
        public bool Write(MsgPackWriter writer, RequestIds ids)
        {
            lock (gate)
            {
                if (startsAfresh) Restart();
                else if (gone.Count > 0) return WriteGone(writer, ids);
                else if (changed.Count == 0) return false;
                FillBatch();
                var scene = new Scene { Id = ids.Next(), Objects = batch, Replace = startsAfresh, AmbientC = ambientC };
                if (startsAfresh) scene.Materials = Admitted();
                startsAfresh = false;
                scene.Write(writer);
                return true;
            }
        }

        /// <summary>All are told anew, in place of what the service knew.</summary>
        void Restart()
        {
            gone.Clear();
            changed.Clear();
            changed.AddRange(objects.Keys);
            isChanged.Clear();
            isChanged.UnionWith(changed);
        }

        /// <summary>The latest that are gone; one that has come back goes out anew after it.</summary>
        bool WriteGone(MsgPackWriter writer, RequestIds ids)
        {
            int from = Math.Max(0, gone.Count - MostPerMessage);
            forgotten.Clear();
            for (int i = from; i < gone.Count; i++)
            {
                forgotten.Add(gone[i]);
                if (objects.ContainsKey(gone[i]) && isChanged.Add(gone[i])) changed.Add(gone[i]);
            }
            gone.RemoveRange(from, gone.Count - from);
            batch.Clear();
            new Scene { Id = ids.Next(), Objects = batch, Replace = false, Forget = forgotten }.Write(writer);
            return true;
        }

        List<string> Admitted()
        {
            admitted.Clear();
            for (int i = 0; i < among.Count && admitted.Count < MostMaterials; i++)
            {
                bool isName = !string.IsNullOrEmpty(among[i]);
                if (isName && IsKnown(among[i]) && !admitted.Contains(among[i])) admitted.Add(among[i]);
            }
            return admitted.Count == 0 ? null : admitted;
        }

        void FillBatch()
        {
            batch.Clear();
            int from = changed.Count > MostPerMessage ? changed.Count - MostPerMessage : 0;
            for (int i = from; i < changed.Count; i++)
            {
                SceneObject stated;
                isChanged.Remove(changed[i]);
                if (!objects.TryGetValue(changed[i], out stated)) continue;
                if (!IsKnown(stated.Material)) stated.Material = null;
                batch.Add(stated);
            }
            changed.RemoveRange(from, changed.Count - from);
        }
    }
}
