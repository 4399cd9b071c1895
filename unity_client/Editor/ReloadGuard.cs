using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>Threads and sockets must not outlive the scripts they run: ends them before a reload.</summary>
    [InitializeOnLoad]
    internal static class ReloadGuard
    {
        static ReloadGuard()
        {
            AssemblyReloadEvents.beforeAssemblyReload += HapticClient.AbortActive;
            EditorApplication.quitting += HapticClient.AbortActive;
        }
    }
}
