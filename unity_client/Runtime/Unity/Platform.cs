using UnityEngine;

namespace HapticVLM
{
    /// <summary>What the engine offers where the scene runs.</summary>
    internal static class Platform
    {
        /// <summary>Whether there are threads and sockets: not in a WebGL player, where nothing is felt.</summary>
        public static bool CanConnect
        {
            get
            {
#if UNITY_WEBGL && !UNITY_EDITOR
                return false;
#else
                return true;
#endif
            }
        }

        /// <summary>Destroys what this package made, in play mode and after it.</summary>
        public static void Destroy(Object made)
        {
            if (Application.isPlaying) Object.Destroy(made);
            else Object.DestroyImmediate(made);
        }
    }
}
