using System;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Address and token of the service for a built game: from the command line (-hapticvlm-url,
    /// -hapticvlm-token), else as stored on this machine, else as stated in the scene. A change of
    /// network then needs no new build, and no token is stored in a scene file.
    /// </summary>
    public static class ServiceAddress
    {
        const string UrlKey = "hapticvlm-url", TokenKey = "hapticvlm-token";

        /// <summary>Stores an address on this machine, for a settings menu; null or empty removes it.</summary>
        public static void Remember(string url, string token = "")
        {
            Store(UrlKey, url);
            Store(TokenKey, token);
            PlayerPrefs.Save();
        }

        /// <summary>Returns the address to use; the scene's own is the default.</summary>
        public static string Url(string ofScene)
        {
            return Override(UrlKey) ?? ofScene;
        }

        /// <summary>Returns the token to use; the scene's own is the default.</summary>
        public static string Token(string ofScene)
        {
            return Override(TokenKey) ?? ofScene;
        }

        /// <summary>Returns the address that a text is; null if it is none of a service.</summary>
        internal static Uri Parse(string text)
        {
            Uri address;
            return Uri.TryCreate(text, UriKind.Absolute, out address) && (address.Scheme == "ws" || address.Scheme == "wss") ? address : null;
        }

        static string Override(string key)
        {
            string[] words = Environment.GetCommandLineArgs();
            int at = Array.IndexOf(words, "-" + key);
            if (at >= 0 && at + 1 < words.Length) return words[at + 1];
            return PlayerPrefs.HasKey(key) ? PlayerPrefs.GetString(key) : null;
        }

        static void Store(string key, string value)
        {
            if (string.IsNullOrEmpty(value)) PlayerPrefs.DeleteKey(key);
            else PlayerPrefs.SetString(key, value);
        }
    }
}
