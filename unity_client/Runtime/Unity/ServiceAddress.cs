using System;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Where the service is and with which token, for a game that was built already: by the command line
    /// (-hapticvlm-url, -hapticvlm-token), else as this machine remembers it, else as the scene says. So
    /// another network needs no other build, and no token stands in a scene file.
    /// </summary>
    public static class ServiceAddress
    {
        const string UrlKey = "hapticvlm-url", TokenKey = "hapticvlm-token";

        /// <summary>Keeps an address on this machine, as of a settings menu; null or empty forgets it.</summary>
        public static void Remember(string url, string token = "")
        {
            Keep(UrlKey, url);
            Keep(TokenKey, token);
            PlayerPrefs.Save();
        }

        /// <summary>The address to use, where the scene says this one.</summary>
        public static string Url(string ofScene)
        {
            return Given(UrlKey) ?? ofScene;
        }

        /// <summary>The token to use, where the scene says this one.</summary>
        public static string Token(string ofScene)
        {
            return Given(TokenKey) ?? ofScene;
        }

        static string Given(string key)
        {
            string[] words = Environment.GetCommandLineArgs();
            int at = Array.IndexOf(words, "-" + key);
            if (at >= 0 && at + 1 < words.Length) return words[at + 1];
            return PlayerPrefs.HasKey(key) ? PlayerPrefs.GetString(key) : null;
        }

        static void Keep(string key, string value)
        {
            if (string.IsNullOrEmpty(value)) PlayerPrefs.DeleteKey(key);
            else PlayerPrefs.SetString(key, value);
        }
    }
}
