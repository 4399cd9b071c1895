// Executable stand-ins for the editor members that the package uses; they record all output.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace UnityEngine
{
    public class ScriptableObject : Object { }
}

namespace UnityEditor
{
    public enum MessageType { None, Info, Warning, Error }

    public enum BuildTarget { Android = 13, WebGL = 20 }

    public sealed class MenuItem : Attribute
    {
        public readonly string Path;

        public MenuItem(string itemName) { Path = itemName; }
        public MenuItem(string itemName, bool isValidateFunction, int priority) { Path = itemName; }
    }

    public sealed class CustomEditor : Attribute { public CustomEditor(Type inspectedType) { } }

    public sealed class CanEditMultipleObjects : Attribute { }

    // Undo reverts changes and destroys created objects.
    public static class Undo
    {
        static readonly List<UnityEngine.Object> Made = new List<UnityEngine.Object>();

        public static readonly List<string> Recorded = new List<string>();

        public delegate void UndoRedoCallback();

        public static UndoRedoCallback undoRedoPerformed;

        // What a person undoes: the fields of the object that was recorded last return to what they were.
        static UnityEngine.Object last;
        static string before;

        public static void Revert()
        {
            Fields.Restore(last, before);
            if (undoRedoPerformed != null) undoRedoPerformed();
        }

        public static void SetCurrentGroupName(string name) { }
        public static int GetCurrentGroup() { return 0; }
        public static void CollapseUndoOperations(int groupIndex) { }
        public static void RegisterCreatedObjectUndo(UnityEngine.Object objectToUndo, string name) { Made.Add(objectToUndo); }
        public static void RecordObject(UnityEngine.Object objectToUndo, string name)
        {
            Recorded.Add(name);
            last = objectToUndo;
            before = Fields.Save(objectToUndo);
        }

        public static T AddComponent<T>(GameObject gameObject) where T : Component, new()
        {
            T made = gameObject.AddComponent<T>();
            Made.Add(made);
            return made;
        }

        public static void PerformUndo()
        {
            foreach (UnityEngine.Object made in Made) Player.Destroy(made);
            Made.Clear();
        }
    }

    // Serialised fields as text: strings, and lists of serialisable classes of strings and numbers.
    static class Fields
    {
        const System.Reflection.BindingFlags Inner = System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic;

        public static string Save(UnityEngine.Object of)
        {
            var lines = new List<string>();
            foreach (System.Collections.IList list in Lists(of))
            {
                foreach (object item in list)
                    foreach (System.Reflection.FieldInfo field in item.GetType().GetFields()) if (!field.IsLiteral) lines.Add(Convert.ToString(field.GetValue(item), System.Globalization.CultureInfo.InvariantCulture));
            }
            return string.Join("\n", lines.ToArray());
        }

        public static void Restore(UnityEngine.Object of, string text)
        {
            string[] lines = text.Split('\n');
            int at = 0;
            foreach (System.Collections.IList list in Lists(of))
            {
                foreach (object item in list)
                    foreach (System.Reflection.FieldInfo field in item.GetType().GetFields())
                        if (!field.IsLiteral) field.SetValue(item, Convert.ChangeType(lines[at++], field.FieldType, System.Globalization.CultureInfo.InvariantCulture));
            }
        }

        static IEnumerable<System.Collections.IList> Lists(UnityEngine.Object of)
        {
            foreach (System.Reflection.FieldInfo field in of.GetType().GetFields(Inner))
            {
                var list = Attribute.IsDefined(field, typeof(SerializeField)) ? field.GetValue(of) as System.Collections.IList : null;
                if (list != null && !(list is Array)) yield return list;
            }
        }
    }

    public static class AssetDatabase
    {
        public static readonly List<string> Imported = new List<string>();

        public static void ImportAsset(string path) { Imported.Add(path); }

        public static T LoadAssetAtPath<T>(string assetPath) where T : UnityEngine.Object
        {
            return (T)(object)new TextAsset(System.IO.File.ReadAllText(assetPath));
        }
    }

    public static class EditorPrefs
    {
        static readonly Dictionary<string, string> Kept = new Dictionary<string, string>();

        public static string GetString(string key, string defaultValue) { return Kept.ContainsKey(key) ? Kept[key] : defaultValue; }
        public static void SetString(string key, string value) { Kept[key] = value; }
    }

    public static class Selection
    {
        public static GameObject[] gameObjects { get; set; } = new GameObject[0];
    }

    // A prefab instance keeps only recorded differences from its prefab; a reload loses the others.
    public static class PrefabUtility
    {
        static readonly Dictionary<UnityEngine.Object, Dictionary<System.Reflection.FieldInfo, object>> Saved = new Dictionary<UnityEngine.Object, Dictionary<System.Reflection.FieldInfo, object>>();

        public static void MakeInstance(UnityEngine.Object part)
        {
            Saved[part] = null;
            RecordPrefabInstancePropertyModifications(part);
        }

        public static void RecordPrefabInstancePropertyModifications(UnityEngine.Object targetObject)
        {
            if (!Saved.ContainsKey(targetObject)) return;
            var values = new Dictionary<System.Reflection.FieldInfo, object>();
            const System.Reflection.BindingFlags Inner = System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic;
            foreach (System.Reflection.FieldInfo field in targetObject.GetType().GetFields(Inner))
            {
                if (Attribute.IsDefined(field, typeof(SerializeField))) values[field] = field.GetValue(targetObject);
            }
            Saved[targetObject] = values;
        }

        public static void SaveAndReload()
        {
            foreach (var part in Saved)
            {
                foreach (var value in part.Value) value.Key.SetValue(part.Key, value.Value);
            }
        }
    }

    public static class EditorUtility
    {
        public static int Dirty;

        public static void SetDirty(UnityEngine.Object target) { Dirty++; }
    }

    // With several objects, reading uses the first and writing changes all.
    public class SerializedProperty
    {
        internal UnityEngine.Object[] Of;
        internal System.Reflection.FieldInfo Field;

        public string stringValue
        {
            get { return (string)Field.GetValue(Of[0]); }
            set { foreach (UnityEngine.Object one in Of) Field.SetValue(one, value); }
        }

        public bool hasMultipleDifferentValues { get { return Array.Exists(Of, one => !Equals(Field.GetValue(one), Field.GetValue(Of[0]))); } }
    }

    public class SerializedObject
    {
        internal UnityEngine.Object[] Of;

        public void Update() { }
        public bool ApplyModifiedProperties() { return true; }

        public SerializedProperty FindProperty(string propertyPath)
        {
            const System.Reflection.BindingFlags Inner = System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic;
            return new SerializedProperty { Of = Of, Field = Of[0].GetType().GetField(propertyPath, Inner) };
        }
    }

    public class Editor : ScriptableObject
    {
        public UnityEngine.Object target { get { return targets[0]; } set { targets = new[] { value }; } }
        public UnityEngine.Object[] targets { get; set; }
        public SerializedObject serializedObject { get { return new SerializedObject { Of = targets }; } }

        public virtual void OnInspectorGUI() { }
        public virtual bool RequiresConstantRepaint() { return false; }
        public bool DrawDefaultInspector() { return false; }
        protected static void DrawPropertiesExcluding(SerializedObject obj, params string[] propertyToExclude) { }
    }

    public class InitializeOnLoadAttribute : Attribute { }

    public class EditorWindow : ScriptableObject
    {
        public static int Repaints;

        public static EditorWindow Last;

        public static T GetWindow<T>(string title) where T : EditorWindow
        {
            var window = Activator.CreateInstance<T>();
            Last = window;
            return window;
        }
        public void Repaint() { Repaints++; }
    }

    public enum PlayModeStateChange { EnteredEditMode, ExitingEditMode, EnteredPlayMode, ExitingPlayMode }

    public static class EditorApplication
    {
        public static event Action<PlayModeStateChange> playModeStateChanged;
        public static event Action hierarchyChanged;

        public static void QueuePlayerLoopUpdate() { }

        public static void ChangeHierarchy() { if (hierarchyChanged != null) hierarchyChanged(); }

        public static void Change(PlayModeStateChange change) { if (playModeStateChanged != null) playModeStateChanged(change); }

        public delegate void CallbackFunction();

        public static CallbackFunction update;
        public static event Action quitting { add { } remove { } }
    }

    public static class AssemblyReloadEvents
    {
        public delegate void AssemblyReloadCallback();

        public static event AssemblyReloadCallback beforeAssemblyReload;

        public static void Reload() { if (beforeAssemblyReload != null) beforeAssemblyReload(); }
    }

    public static class EditorUserBuildSettings
    {
        public static BuildTarget activeBuildTarget { get; set; }
    }

    public static class PlayerSettings
    {
        public static bool runInBackground { get; set; }

        public static class Android
        {
            public static bool forceInternetPermission { get; set; }
        }
    }

    public static class EditorStyles
    {
        public static GUIStyle boldLabel { get { return null; } }
    }

    public static class EditorGUI
    {
        public static bool showMixedValue { get; set; }
    }

    public static class EditorGUILayout
    {
        public static readonly List<string> Output = new List<string>();

        public static void LabelField(string label, params GUILayoutOption[] options) { Output.Add(label); }
        public static void LabelField(string label, GUIStyle style, params GUILayoutOption[] options) { Output.Add(label); }
        public static void LabelField(string label, string label2, params GUILayoutOption[] options) { Output.Add(label + ": " + label2); }
        public static string TextField(string label, string text, params GUILayoutOption[] options) { return text; }
        public static string PasswordField(string label, string password, params GUILayoutOption[] options) { return password; }
        public static string Chosen, ChosenFor; // the choice of the simulated user

        public static int Popup(string label, int selectedIndex, string[] displayedOptions, params GUILayoutOption[] options)
        {
            Output.Add(label + ": [" + displayedOptions[selectedIndex] + "]");
            if (ChosenFor == null || !label.StartsWith(ChosenFor)) return selectedIndex;
            ChosenFor = null;
            return Array.IndexOf(displayedOptions, Chosen);
        }

        public static void HelpBox(string message, MessageType type) { Output.Add(type + ": " + message); }
        public static Vector2 BeginScrollView(Vector2 scrollPosition, params GUILayoutOption[] options) { return scrollPosition; }
        public static void EndScrollView() { }
    }
}

namespace UnityEditor.SceneManagement
{
    public sealed class PrefabStage { }

    public static class PrefabStageUtility
    {
        public static PrefabStage Open;

        public static PrefabStage GetCurrentPrefabStage() { return Open; }
    }

    public static class EditorSceneManager
    {
        public static int Marked;

        public static bool MarkSceneDirty(UnityEngine.SceneManagement.Scene scene)
        {
            Marked++;
            return true;
        }
    }
}
