using System;
using System.Collections.Generic;
using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// Logs each change of the link once, with the remedy, also on a headset, where the log is the only
    /// information. A message that repeats with every touch or attempt is logged once.
    /// </summary>
    internal sealed class StateLog
    {
        const int MaxRefusals = 32;
        const double SteadyS = 2.0; // so that the start of a connection is no change
        const string NotFelt = "This scene is felt as soon as the other scene is closed, or when a hand touches something here after the other was idle for 30 s.";

        readonly HashSet<string> refused = new HashSet<string>();
        string reported;
        int openings;
        bool isReportedOwner;
        FeltMode reportedBy = FeltMode.Auto; // none yet
        FeltMode feltBy = FeltMode.Auto;
        double feltSince;
        bool isUnopenedReported;

        public void Restart()
        {
            refused.Clear();
            reported = null;
            openings = 0;
        }

        /// <summary>Logs changes of the link. Called once per frame; does nothing while the link is unchanged.</summary>
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
                Debug.LogWarning("HapticVLM: " + reported + ". Retrying automatically.", client);
            }
        }

        /// <summary>Logs a change of ownership after the welcome, whose log line states the first owner.</summary>
        public void Owned(bool isOwner, HapticClient client)
        {
            if (openings == 0 || isOwner == isReportedOwner) return;
            isReportedOwner = isOwner;
            if (isOwner) Debug.Log("HapticVLM: this scene owns the outputs now and is felt.", client);
            else if (client.State == LinkState.Ready) Debug.LogWarning("HapticVLM: another scene took the outputs. " + NotFelt, client);
        }

        /// <summary>Logs each change between the service and the bake. Called once per frame.</summary>
        public void FeltBy(FeltMode by, FeltMode mode, HapticClient client)
        {
            double now = Clock.Now;
            if (by != feltBy) feltSince = now;
            feltBy = by;
            if (by == reportedBy || now - feltSince < SteadyS) return;
            bool isFirst = reportedBy == FeltMode.Auto;
            reportedBy = by;
            if (isFirst && by == FeltMode.Service) return; // as the line on the connection says
            string why = mode == FeltMode.Auto && by == FeltMode.Baked ? (client.State == LinkState.Ready ? ", because another scene owns the outputs" : ", because no service answers") : "";
            Debug.Log("HapticVLM: felt from the " + (by == FeltMode.Baked ? "bake" : "service") + " now" + why + ".", client);
        }

        public void Unopened(Exception error, HapticClient client)
        {
            if (!isUnopenedReported) Debug.LogError("HapticVLM: the bake cannot be read: " + error.Message, client);
            isUnopenedReported = true;
        }

        public void Refused(string text, HapticClient client)
        {
            if (refused.Count >= MaxRefusals || !refused.Add(text)) return;
            Debug.LogWarning("HapticVLM: the service refused a message: " + text, client);
        }

        public void LeftOut(string path, string text, HapticClient client)
        {
            if (refused.Count >= MaxRefusals || !refused.Add(text)) return;
            Debug.LogWarning("HapticVLM: " + path + ": " + text, client);
        }

        public void Failed(Exception error, HapticClient client)
        {
            if (refused.Count >= MaxRefusals || !refused.Add(error.Message)) return;
            Debug.LogError("HapticVLM: a message could not be sent: " + error.Message, client);
        }

        public string Status(HapticConnection connection, string url)
        {
            if (connection == null) return "not connected";
            if (connection.State == LinkState.Ready) return Welcomed(connection, url);
            string reason = connection.LastError;
            return "connecting to " + url + (reason.Length > 0 ? ": " + reason : "");
        }

        void Opened(HapticConnection connection, string url, HapticClient client)
        {
            isReportedOwner = connection.IsOwner;
            if (isReportedOwner) Debug.Log("HapticVLM: " + Welcomed(connection, url), client);
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
