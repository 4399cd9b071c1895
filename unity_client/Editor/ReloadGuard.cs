using UnityEditor;

namespace HapticVLM.Editor
{
    /// <summary>Ends threads and sockets before a script reload, because they must not outlive their scripts.</summary>
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
