// Engine members that only the samples use.
using System;

namespace UnityEngine
{
    public enum PrimitiveType { Sphere = 0, Cube = 3 }

    public enum TouchScreenKeyboardType { Default = 0, URL = 3 }

    // The system's keyboard, with a user who immediately types the text in Typed.
    public sealed class TouchScreenKeyboard
    {
        public enum Status { Visible = 0, Done = 1, Canceled = 2, LostFocus = 3 }

        public static string Typed;

        public static bool isSupported { get { return Typed != null; } }
        public string text { get; set; }
        public Status status { get; private set; }

        public static TouchScreenKeyboard Open(string text, TouchScreenKeyboardType keyboardType)
        {
            return new TouchScreenKeyboard { text = Typed, status = Status.Done };
        }
    }
}
