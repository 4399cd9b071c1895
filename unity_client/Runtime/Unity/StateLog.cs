using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Writes each change of the link to the console once, with its cure: also on a headset, where the
    /// log is all a developer has. What repeats at every touch or every try is written once.
    /// </summary>
    internal sealed class StateLog
    {
        const int MostKept = 32;

        readonly HashSet<string> refused = new HashSet<string>();
        string reported;
        int openings;

        public void Restart()
        {
            refused.Clear();
            reported = null;
            openings = 0;
        }

        /// <summary>Once a frame; costs nothing while nothing changes.</summary>
        public void Follow(HapticConnection connection, string url, HapticClient client)
        {
            if (connection.State == LinkState.Ready && connection.Openings != openings)
            {
                openings = connection.Openings;
                reported = null;
                refused.Clear();
                Opened(connection.Welcome, url, client);
            }
            else if (connection.State == LinkState.Waiting && connection.LastError != reported)
            {
                reported = connection.LastError;
                Debug.LogWarning("HapticVLM: " + reported + ". It tries again by itself.", client);
            }
        }

        public void Refused(string text, HapticClient client)
        {
            if (refused.Count >= MostKept || !refused.Add(text)) return;
            Debug.LogWarning("HapticVLM: the service refuses a message: " + text, client);
        }

        public void Failed(Exception error, HapticClient client)
        {
            if (refused.Count >= MostKept || !refused.Add(error.Message)) return;
            Debug.LogError("HapticVLM: a message could not be sent: " + error.Message, client);
        }

        public string Status(HapticConnection connection, string url)
        {
            if (connection == null) return "not connected";
            if (connection.State == LinkState.Ready) return Welcomed(connection.Welcome, url);
            string why = connection.LastError;
            return "connecting to " + url + (why.Length > 0 ? ": " + why : "");
        }

        static void Opened(Welcome welcome, string url, HapticClient client)
        {
            if (welcome.Owner) Debug.Log("HapticVLM: " + Welcomed(welcome, url), client);
            else Debug.LogWarning("HapticVLM: " + Welcomed(welcome, url), client);
        }

        static string Welcomed(Welcome welcome, string url)
        {
            string devices = "speaker " + Named(welcome.Devices.Speaker) + ", plate " + Named(welcome.Devices.Peltier);
            string state = "connected to " + url + ", " + devices;
            if (welcome.Owner) return state;
            return state + ". Another scene owns the outputs, so this one is decided but not felt: close the other, "
                + "then disable and enable the Haptic Client.";
        }

        static string Named(Device device)
        {
            return device.Simulated ? "simulated" : device.Name;
        }
    }
}
