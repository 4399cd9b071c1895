using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>How to reach the service and how patient to be. Set before the connection is made.</summary>
    public sealed class ConnectionSettings
    {
        public Uri Url = new Uri("ws://127.0.0.1:8790/");
        public string Token;
        public string ClientName = "unity";
        public string ClientVersion = "0.3.0";
        public HelloRole Role = HelloRole.Scene;

        /// <summary>Whether this scene wants to be felt; a tool that only shows pictures gives the outputs up.</summary>
        public bool WantsOutputs = true;
        public int ConnectTimeoutMs = 3000;
        public int SendTimeoutMs = 5000;

        /// <summary>The service speaks ten times a second; silent this long, it is given up.</summary>
        public double SilenceS = 10.0;
        public double FirstRetryS = 0.25;
        public double LongestRetryS = 8.0;
    }
}
