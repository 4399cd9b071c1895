using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Address, identity and timeouts of a connection. Set them before the connection is created.</summary>
    public sealed class ConnectionSettings
    {
        public Uri Url = new Uri("ws://127.0.0.1:8790/");
        public string Token;
        public string ClientName = "unity";
        public string ClientVersion = "0.4.0";
        public HelloRole Role = HelloRole.Scene;

        /// <summary>Whether to request the outputs; a tool that only sends pictures sets false and releases them.</summary>
        public bool WantsOutputs = true;
        public int ConnectTimeoutMs = 3000;
        public int SendTimeoutMs = 5000;

        /// <summary>The link is closed after this long without a message; telemetry arrives ten times a second.</summary>
        public double SilenceS = 10.0;
        public double FirstRetryS = 0.25;
        public double LongestRetryS = 8.0;
    }
}
