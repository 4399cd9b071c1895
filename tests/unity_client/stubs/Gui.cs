namespace UnityEngine
{
    public sealed class GUILayoutOption { }

    public sealed class GUIStyle { }

    public static class GUI
    {
        public static Color backgroundColor { get; set; }
    }

    public static class GUILayout
    {
        public static string Pressed = "";

        public static readonly System.Collections.Generic.List<string> Labels = new System.Collections.Generic.List<string>();

        public static void Label(string text, params GUILayoutOption[] options) { Labels.Add(text); }
        public static void Space(float pixels) { }
        public static GUILayoutOption Height(float height) { return null; }

        public static bool Button(string text, params GUILayoutOption[] options)
        {
            bool isPressed = text == Pressed;
            if (isPressed) Pressed = "";
            return isPressed;
        }
    }
}
