using System;
using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The objects of the scene, and which of them have changes that were not sent yet. Changes are
    /// sent together, in messages of at most 1 MiB; after a reconnect all objects are. A material that the service does not know is
    /// omitted, because the service would refuse the whole message for it. Removed objects are sent as a
    /// list of ids in a separate message, which an older service can refuse without losing anything else.
    /// </summary>
    public sealed class SceneRegistry
    {
        const int MaxPerMessage = 1024; // objects; the protocol allows 4096
        const int MaxBytes = 1 << 20; // of one message; the protocol allows 4 MiB
        const int MaxMaterials = 64; // limit of the scene message

        struct Entry
        {
            public SceneObject Object;
            public int Bytes; // of the object in a message
        }

        readonly object gate = new object();
        readonly Dictionary<string, Entry> objects = new Dictionary<string, Entry>();
        readonly MsgPackWriter measure = new MsgPackWriter();
        readonly List<string> changed = new List<string>(); // oldest first, each once
        readonly HashSet<string> isChanged = new HashSet<string>();
        readonly List<string> removed = new List<string>();
        readonly List<string> removedBatch = new List<string>();
        readonly List<SceneObject> batch = new List<SceneObject>();
        readonly HashSet<string> knownMaterials = new HashSet<string>();
        readonly List<string> allowed = new List<string>();
        readonly List<string> allowedKnown = new List<string>();
        double? ambientC;
        bool sendsAll = true;
        bool knowsSurfaces;

        /// <summary>Called on the caller's thread with an object's id and a sentence when a text of it was cut.</summary>
        public event Action<string, string> Cut;

        public int Count { get { lock (gate) return objects.Count; } }

        /// <summary>
        /// Adds or changes an object. Its texts are truncated to the limits of the protocol. Throws WireException for one
        /// that cannot be encoded, and then changes nothing.
        /// </summary>
        public void Put(SceneObject sceneObject)
        {
            if (string.IsNullOrEmpty(sceneObject.ObjectId)) throw new WireException("an object of the scene needs an id");
            sceneObject.ObjectId = WireText.Within(sceneObject.ObjectId, SceneObject.ObjectIdMaxLength);
            if (sceneObject.Name != null && sceneObject.Name.Length > SceneObject.NameMaxLength && Cut != null)
                Cut(sceneObject.ObjectId, "its name has " + sceneObject.Name.Length + " characters and the limit is " + SceneObject.NameMaxLength + ": cut; shorten it");
            sceneObject.Name = WireText.End(sceneObject.Name, SceneObject.NameMaxLength); // the object's own name, behind its parents'
            sceneObject.Material = WireText.Within(sceneObject.Material, SceneObject.MaterialMaxLength);
            sceneObject.Surfaces = Within(sceneObject.Surfaces);
            lock (gate)
            {
                objects[sceneObject.ObjectId] = Measured(sceneObject);
                if (!sendsAll && isChanged.Add(sceneObject.ObjectId)) changed.Add(sceneObject.ObjectId);
            }
        }

        public void Remove(string objectId)
        {
            lock (gate)
            {
                if (objects.Remove(objectId) && !sendsAll) removed.Add(objectId);
            }
        }

        /// <summary>States the texture map of a surface by its hash; does nothing for an object or surface that is not there.</summary>
        public void SetTexture(string objectId, int surface, string hash)
        {
            lock (gate)
            {
                Entry entry;
                if (!objects.TryGetValue(objectId, out entry) || entry.Object.Surfaces == null || surface >= entry.Object.Surfaces.Count) return;
                ObjectSurface stated = entry.Object.Surfaces[surface];
                if (stated.Texture == hash) return;
                stated.Texture = hash;
                entry.Object.Surfaces[surface] = stated;
                objects[objectId] = Measured(entry.Object);
                if (!sendsAll && isChanged.Add(objectId)) changed.Add(objectId);
            }
        }

        /// <summary>Sets the ambient temperature of the scene, degC; null if the scene states none.</summary>
        public void SetAmbient(double? celsius)
        {
            lock (gate)
            {
                if (celsius != ambientC) sendsAll = true;
                ambientC = celsius;
            }
        }

        /// <summary>Sets the materials that objects of the scene can have; null or empty allows all.</summary>
        public void SetMaterials(IList<string> names)
        {
            lock (gate)
            {
                int count = names == null ? 0 : names.Count;
                bool same = count == allowed.Count;
                for (int i = 0; same && i < count; i++) same = names[i] == allowed[i];
                if (same) return;
                allowed.Clear();
                for (int i = 0; i < count; i++) allowed.Add(names[i]);
                sendsAll = true;
            }
        }

        /// <summary>Queues all objects for a new session, whose service knows these materials, and surfaces or not.</summary>
        public void Restart(List<string> known, bool nowKnowsSurfaces = false)
        {
            lock (gate)
            {
                knowsSurfaces = nowKnowsSurfaces;
                knownMaterials.Clear();
                knownMaterials.UnionWith(known);
                sendsAll = true;
            }
        }

        /// <summary>Whether the service knows this material; true before the first welcome.</summary>
        public bool IsKnown(string material)
        {
            lock (gate) return material == null || knownMaterials.Count == 0 || knownMaterials.Contains(material);
        }

        /// <summary>Encodes the next scene message; false if there are no changes.</summary>
        public bool Write(MsgPackWriter writer, RequestIds ids)
        {
            lock (gate)
            {
                if (sendsAll) Restart();
                else if (removed.Count > 0) return WriteRemoved(writer, ids);
                else if (changed.Count == 0) return false;
                FillBatch();
                var scene = new Scene { Id = ids.Next(), Objects = batch, Replace = sendsAll, AmbientC = ambientC };
                if (sendsAll) scene.Materials = AllowedKnown();
                sendsAll = false;
                scene.Write(writer);
                return true;
            }
        }

        /// <summary>Queues all objects, to replace those the service knows.</summary>
        void Restart()
        {
            removed.Clear();
            changed.Clear();
            changed.AddRange(objects.Keys);
            isChanged.Clear();
            isChanged.UnionWith(changed);
        }

        /// <summary>Encodes the latest removals. An object added again since is sent after them.</summary>
        bool WriteRemoved(MsgPackWriter writer, RequestIds ids)
        {
            int from = Math.Max(0, removed.Count - MaxPerMessage);
            removedBatch.Clear();
            for (int i = from; i < removed.Count; i++)
            {
                removedBatch.Add(removed[i]);
                if (objects.ContainsKey(removed[i]) && isChanged.Add(removed[i])) changed.Add(removed[i]);
            }
            removed.RemoveRange(from, removed.Count - from);
            batch.Clear();
            new Scene { Id = ids.Next(), Objects = batch, Replace = false, Forget = removedBatch }.Write(writer);
            return true;
        }

        List<string> AllowedKnown()
        {
            allowedKnown.Clear();
            for (int i = 0; i < allowed.Count && allowedKnown.Count < MaxMaterials; i++)
            {
                bool isName = !string.IsNullOrEmpty(allowed[i]);
                if (isName && IsKnown(allowed[i]) && !allowedKnown.Contains(allowed[i])) allowedKnown.Add(allowed[i]);
            }
            return allowedKnown.Count == 0 ? null : allowedKnown;
        }

        void FillBatch()
        {
            batch.Clear();
            int from = changed.Count, bytes = 0;
            Entry entry;
            while (from > 0 && changed.Count - from < MaxPerMessage)
            {
                objects.TryGetValue(changed[from - 1], out entry); // else it was removed, and has no bytes
                bytes += entry.Bytes;
                if (bytes > MaxBytes && bytes > entry.Bytes) break; // one that is larger by itself is sent alone
                from--;
            }
            for (int i = from; i < changed.Count; i++)
            {
                isChanged.Remove(changed[i]);
                if (!objects.TryGetValue(changed[i], out entry)) continue;
                SceneObject sceneObject = entry.Object;
                if (!IsKnown(sceneObject.Material)) sceneObject.Material = null;
                batch.Add(knowsSurfaces ? sceneObject : WithoutSurfaces(sceneObject));
            }
            changed.RemoveRange(from, changed.Count - from);
        }

        Entry Measured(SceneObject sceneObject)
        {
            measure.Reset();
            sceneObject.Write(measure);
            return new Entry { Object = sceneObject, Bytes = measure.Length };
        }

        static List<ObjectSurface> Within(List<ObjectSurface> surfaces)
        {
            if (surfaces == null) return null;
            var within = new List<ObjectSurface>();
            for (int i = 0; i < surfaces.Count && i <= Touch.SurfaceMax; i++)
            {
                ObjectSurface surface = surfaces[i];
                surface.Name = WireText.Within(surface.Name, ObjectSurface.NameMaxLength);
                within.Add(surface);
            }
            return within;
        }

        /// <summary>Puts the name of the largest surface before that of the object, for a service that knows no surfaces and no opacity.</summary>
        static SceneObject WithoutSurfaces(SceneObject sceneObject)
        {
            List<ObjectSurface> surfaces = sceneObject.Surfaces;
            sceneObject.Surfaces = null;
            if (sceneObject.Shader != null)
            {
                var shader = sceneObject.Shader.Value;
                shader.Opacity = null;
                sceneObject.Shader = shader;
            }
            if (surfaces == null || surfaces.Count == 0 || surfaces[0].Name == null || sceneObject.Name == null) return sceneObject;
            int leaf = sceneObject.Name.LastIndexOf('/') + 1;
            string name = sceneObject.Name.Insert(leaf, surfaces[0].Name + " ");
            if (name.Length > SceneObject.NameMaxLength) name = name.Substring(leaf); // without its parents
            sceneObject.Name = WireText.Within(name, SceneObject.NameMaxLength);
            return sceneObject;
        }
    }
}
