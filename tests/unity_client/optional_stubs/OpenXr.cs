// Stand-ins for members of the OpenXR plug-in 1.7, in front of the runtime of openxr_runtime.c.
using System;
using System.Runtime.InteropServices;
using UnityEngine.XR.OpenXR.Features;

namespace UnityEngine.XR.OpenXR
{
    public static class OpenXRRuntime
    {
        public static bool IsExtensionEnabled(string name) { return name == "XR_FB_haptic_pcm"; }
    }

    public class OpenXRSettings
    {
        public static readonly OpenXRSettings Instance = new OpenXRSettings();

        public T GetFeature<T>() where T : OpenXRFeature { return StandInRuntime.Feature as T; }
    }

    public static class StandInRuntime
    {
        public const ulong Action = 11;
        public static OpenXRFeature Feature;

        const string Library = "openxr_runtime";

        public static int Count { get { return Counted(0); } }
        public static int Appended { get { return Counted(1); } }
        public static int Stops { get { return Counted(2); } }

        public static void Begin(OpenXRFeature feature)
        {
            Feature = feature;
            feature.enabled = feature.OnInstanceCreate(7);
            if (feature.enabled) feature.OnSessionCreate(9);
        }

        [DllImport(Library, EntryPoint = "finder")] internal static extern IntPtr Finder();
        [DllImport(Library, EntryPoint = "set_rate")] public static extern void SetRate(float hz);
        [DllImport(Library, EntryPoint = "sample")] public static extern float Sample(int at);
        [DllImport(Library, EntryPoint = "counted")] static extern int Counted(int what);
    }
}

namespace UnityEngine.XR.OpenXR.Features
{
    public abstract class OpenXRFeature
    {
        public bool enabled { get; set; }

        protected static IntPtr xrGetInstanceProcAddr { get { return StandInRuntime.Finder(); } }

        protected static ulong StringToPath(string str) { return str == "/user/hand/right" ? 3ul : str == "/user/hand/left" ? 2ul : 0ul; }

        protected internal virtual bool OnInstanceCreate(ulong xrInstance) { return true; }
        protected internal virtual void OnInstanceDestroy(ulong xrInstance) { }
        protected internal virtual void OnSessionCreate(ulong xrSession) { }
        protected internal virtual void OnSessionDestroy(ulong xrSession) { }
    }
}

#if UNITY_EDITOR
namespace UnityEditor
{
    public enum BuildTargetGroup { Standalone = 1, Android = 7 }
}

namespace UnityEditor.XR.OpenXR.Features
{
    [AttributeUsage(AttributeTargets.Class)]
    public class OpenXRFeatureAttribute : Attribute
    {
        public string UiName, Desc, Company, Version, OpenxrExtensionStrings, FeatureId;
        public BuildTargetGroup[] BuildTargetGroups;
    }
}
#endif
