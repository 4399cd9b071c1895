using System.Collections.Generic;
using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>Project settings that silently keep the scene from being felt.</summary>
    internal static class ProjectChecks
    {
        public static List<string> Problems()
        {
            var found = new List<string>();
            if (!PlayerSettings.runInBackground)
                found.Add("Player Settings > Run In Background is off: touches end when the window loses focus.");
            if (EditorUserBuildSettings.activeBuildTarget == BuildTarget.Android && !PlayerSettings.Android.forceInternetPermission)
                found.Add("Player Settings > Internet Access is Auto: set Require, or the headset may open no socket, "
                    + "and keep OpenXR's Force Remove Internet off.");
            if (EditorUserBuildSettings.activeBuildTarget == BuildTarget.WebGL)
                found.Add("WebGL has no threads and no ClientWebSocket: this package does not run there.");
            return found;
        }
    }
}
