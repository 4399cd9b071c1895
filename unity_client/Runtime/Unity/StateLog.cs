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
        const string NotFelt = "This one is felt as soon as the other is closed, or has touched nothing for 30 s when a hand of this one touches.";

        readonly HashSet<string> refused = new HashSet<string>();
        string reported;
        int openings;
        bool isToldFelt;

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
                Opened(connection, url, client);
            }
            else if (connection.State == LinkState.Waiting && connection.LastError != reported)
            {
                reported = connection.LastError;
                Debug.LogWarning("HapticVLM: " + reported + ". It tries again by itself.", client);
            }
        }

        /// <summary>What changes after the welcome; that one is told with it.</summary>
        public void Owned(bool isOwner, HapticClient client)
        {
            if (openings == 0 || isOwner == isToldFelt) return;
            isToldFelt = isOwner;
            if (isOwner) Debug.Log("HapticVLM: this scene owns the outputs now and is felt.", client);
            else if (client.State == LinkState.Ready) Debug.LogWarning("HapticVLM: another scene took the outputs. " + NotFelt, client);
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
            if (connection.State == LinkState.Ready) return Welcomed(connection, url);
            string why = connection.LastError;
            return "connecting to " + url + (why.Length > 0 ? ": " + why : "");
        }

        void Opened(HapticConnection connection, string url, HapticClient client)
        {
            isToldFelt = connection.IsOwner;
            if (isToldFelt) Debug.Log("HapticVLM: " + Welcomed(connection, url), client);
            else Debug.LogWarning("HapticVLM: " + Welcomed(connection, url), client);
        }

        static string Welcomed(HapticConnection connection, string url)
        {
            Welcome welcome = connection.Welcome;
            string devices = "speaker " + Named(welcome.Devices.Speaker) + ", plate " + Named(welcome.Devices.Peltier);
            string state = "connected to " + url + ", " + devices;
            return connection.IsOwner ? state : state + ". Another scene owns the outputs. " + NotFelt;
        }

        static string Named(Device device)
        {
            return device.Simulated ? "simulated" : device.Name;
        }
    }
}
