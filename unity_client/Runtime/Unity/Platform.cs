using UnityEngine;

namespace HapticVLM
{
    /// <summary>Differences between the platforms on which a scene runs.</summary>
    internal static class Platform
    {
        /// <summary>Whether there is a network part: a WebGL player has no sockets, and HAPTICVLM_NO_NETWORK builds without it.</summary>
        public static bool CanConnect
        {
            get
            {
#if HAPTICVLM_NO_NETWORK
                return false;
#else
                return HasThreads;
#endif
            }
        }

        /// <summary>Whether the platform has threads; a WebGL player does not.</summary>
        public static bool HasThreads
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

        /// <summary>Destroys an object of this package, in play mode and in edit mode.</summary>
        public static void Destroy(Object target)
        {
            if (Application.isPlaying) Object.Destroy(target);
            else Object.DestroyImmediate(target);
        }
    }
}
