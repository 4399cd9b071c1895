using System.Collections.Generic;
using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>Checks project settings that silently disable haptics.</summary>
    internal static class ProjectChecks
    {
        public static List<string> Problems()
        {
            var problems = new List<string>();
            if (!PlayerSettings.runInBackground)
                problems.Add("Player Settings > Run In Background is off: touches end when the window loses focus.");
            if (EditorUserBuildSettings.activeBuildTarget == BuildTarget.Android && !PlayerSettings.Android.forceInternetPermission)
                problems.Add("Player Settings > Internet Access is Auto: set Require, or the headset may open no socket, "
                    + "and keep OpenXR's Force Remove Internet off.");
            if (EditorUserBuildSettings.activeBuildTarget == BuildTarget.WebGL)
                problems.Add("WebGL has no threads and no ClientWebSocket: this player feels a bake, and no service.");
            if (MouseHand.InputProblem != null) problems.Add("Mouse Hand: " + MouseHand.InputProblem + ".");
            return problems;
        }
    }
}
