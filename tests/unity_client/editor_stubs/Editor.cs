// Executable stand-ins of our own for the editor members the package uses; they note what is shown.
using System;
using System.Collections.Generic;
using UnityEngine;

namespace UnityEngine
{
    public struct Vector2 { }

    public class ScriptableObject : Object { }
}

namespace UnityEditor
{
    public enum MessageType { None, Info, Warning, Error }

    public enum BuildTarget { Android = 13, WebGL = 20 }

    public sealed class MenuItem : Attribute { public MenuItem(string itemName) { } }

    public class InitializeOnLoadAttribute : Attribute { }

    public class EditorWindow : ScriptableObject
    {
        public static int Repaints;

        public static T GetWindow<T>(string title) where T : EditorWindow { return Activator.CreateInstance<T>(); }
        public void Repaint() { Repaints++; }
    }

    public static class EditorApplication
    {
        public delegate void CallbackFunction();

        public static CallbackFunction update;
        public static event Action quitting;

        public static void Quit() { if (quitting != null) quitting(); }
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

    public static class EditorGUILayout
    {
        public static readonly List<string> Shown = new List<string>();

        public static void LabelField(string label, params GUILayoutOption[] options) { Shown.Add(label); }
        public static void LabelField(string label, GUIStyle style, params GUILayoutOption[] options) { Shown.Add(label); }
        public static void LabelField(string label, string label2, params GUILayoutOption[] options) { Shown.Add(label + ": " + label2); }
        public static string TextField(string label, string text, params GUILayoutOption[] options) { return text; }
        public static string PasswordField(string label, string password, params GUILayoutOption[] options) { return password; }
        public static void HelpBox(string message, MessageType type) { Shown.Add(type + ": " + message); }
        public static Vector2 BeginScrollView(Vector2 scrollPosition, params GUILayoutOption[] options) { return scrollPosition; }
        public static void EndScrollView() { }
    }
}
