// Executable stand-ins for the engine members that the package uses. They contain no engine code.
using System;
using System.Collections.Generic;

namespace UnityEngine
{
    [Flags]
    public enum HideFlags { None = 0, HideAndDontSave = 61 }

    public class Object
    {
        internal bool IsDead;
        public bool IsGone { get { return IsDead; } }

        public string name { get; set; }
        public HideFlags hideFlags { get; set; }

        public static void Destroy(Object dead)
        {
            if (!Application.isPlaying) Debug.LogError("Destroy may not be called from edit mode", dead);
            Player.Destroy(dead);
        }

        public static readonly System.Collections.Generic.List<Object> KeptAcrossScenes = new System.Collections.Generic.List<Object>();

        public static void DontDestroyOnLoad(Object target)
        {
            if (((GameObject)target).Parent != null) Debug.LogError("DontDestroyOnLoad only works for root GameObjects", target);
            KeptAcrossScenes.Add(target);
        }

        public static void DestroyImmediate(Object dead)
        {
            Player.Destroy(dead);
        }

        public static bool operator ==(Object a, Object b)
        {
            bool noA = ReferenceEquals(a, null) || a.IsDead, noB = ReferenceEquals(b, null) || b.IsDead;
            return noA || noB ? noA && noB : ReferenceEquals(a, b);
        }

        public static bool operator !=(Object a, Object b)
        {
            return !(a == b);
        }

        public override bool Equals(object other)
        {
            return this == (other as Object);
        }

        public override int GetHashCode()
        {
            return System.Runtime.CompilerServices.RuntimeHelpers.GetHashCode(this);
        }
    }

    public class TextAsset : Object
    {
        public string text { get; }

        public TextAsset(string text) { this.text = text; }
    }

    // What ships in the Resources folders of the package; the test programs name the folder.
    public static class Resources
    {
        public static T Load<T>(string path) where T : Object
        {
            string file = Environment.GetEnvironmentVariable("UNITY_RESOURCES") + "/" + path + ".json";
            return System.IO.File.Exists(file) ? (T)(object)new TextAsset(System.IO.File.ReadAllText(file)) : null;
        }
    }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }
        public Transform transform { get { return gameObject.transform; } }
        public new string name { get { return gameObject.name; } }

        public T GetComponent<T>() { return gameObject.GetComponent<T>(); }

        public bool CompareTag(string tag) { return gameObject.tag == tag; }

        public T GetComponentInChildren<T>() { return gameObject.GetComponentInChildren<T>(); }

        public T GetComponentInParent<T>()
        {
            for (GameObject at = gameObject; !ReferenceEquals(at, null); at = at.Parent)
            {
                T found = at.GetComponent<T>();
                if (!ReferenceEquals(found, null)) return found;
            }
            return default(T);
        }

        public void GetComponentsInChildren<T>(List<T> results)
        {
            results.Clear();
            gameObject.Collect(results);
        }
    }

    public class Behaviour : Component
    {
        bool isOn = true;

        public bool enabled
        {
            get { return isOn; }
            set
            {
                if (isOn == value) return;
                isOn = value;
                Player.Switch(this as MonoBehaviour);
            }
        }

        public bool isActiveAndEnabled { get { return isOn && !IsDead && gameObject.activeInHierarchy; } }
    }

    public class MonoBehaviour : Behaviour
    {
        internal bool WasEnabled;
    }

    public sealed class GameObject : Object
    {
        internal readonly List<Component> Parts = new List<Component>();
        internal readonly List<GameObject> Children = new List<GameObject>();
        internal GameObject Parent;
        bool isActive = true;

        public static readonly List<GameObject> Scene = new List<GameObject>();

        public GameObject(string name)
        {
            Scene.Add(this);
            this.name = name;
            transform = new Transform { gameObject = this };
            Parts.Add(transform);
        }

        public GameObject() : this("New Game Object") { }

        public static GameObject CreatePrimitive(PrimitiveType type)
        {
            var made = new GameObject(type.ToString());
            made.AddComponent<MeshFilter>().sharedMesh = new Mesh();
            made.AddComponent<MeshRenderer>();
            Physics.World.Add(type == PrimitiveType.Sphere ? (Collider)made.AddComponent<SphereCollider>() : made.AddComponent<BoxCollider>());
            return made;
        }

        public Transform transform { get; private set; }
        public int layer { get; set; }
        public string tag { get; set; } = "Untagged";
        public SceneManagement.Scene scene { get { return default(SceneManagement.Scene); } }
        public bool activeInHierarchy { get { return isActive && !IsDead && (ReferenceEquals(Parent, null) || Parent.activeInHierarchy); } }

        public void SetActive(bool value)
        {
            isActive = value;
            foreach (Component part in Parts) Player.Switch(part as MonoBehaviour);
        }

        public T AddComponent<T>() where T : Component, new()
        {
            var part = new T { gameObject = this };
            Parts.Add(part);
            Player.Start(part as MonoBehaviour);
            return part;
        }

        public T GetComponent<T>()
        {
            for (int i = 0; i < Parts.Count; i++)
            {
                if (Parts[i] is T && !Parts[i].IsDead) return (T)(object)Parts[i];
            }
            return default(T);
        }

        public T GetComponentInParent<T>()
        {
            return transform.GetComponentInParent<T>();
        }

        public void GetComponentsInChildren<T>(bool includeInactive, List<T> results)
        {
            results.Clear();
            Collect(results);
        }

        public T[] GetComponentsInChildren<T>()
        {
            var found = new List<T>();
            Collect(found);
            return found.ToArray();
        }

        public T GetComponentInChildren<T>()
        {
            T found = GetComponent<T>();
            for (int i = 0; i < Children.Count && ReferenceEquals(found, null); i++) found = Children[i].GetComponentInChildren<T>();
            return found;
        }

        internal void Collect<T>(List<T> results)
        {
            for (int i = 0; i < Parts.Count; i++)
            {
                if (Parts[i] is T && !Parts[i].IsDead) results.Add((T)(object)Parts[i]);
            }
            for (int i = 0; i < Children.Count; i++) Children[i].Collect(results);
        }
    }
}
