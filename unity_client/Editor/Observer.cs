using System;
using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM.Editor
{
    /// <summary>The latest decisions and plate state, from an observer connection that works in and out of play mode.</summary>
    internal sealed class Observer
    {
        const int MaxDecisions = 12;

        public readonly List<string> Decisions = new List<string>();
        readonly HapticConnection connection;

        public Observer(Uri url, string token)
        {
            var settings = new ConnectionSettings { Url = url, Token = token, Role = HelloRole.Observer, ClientName = "unity editor" };
            connection = new HapticConnection(settings);
            connection.Arrivals.Decided += OnDecided;
            connection.Arrivals.Measured += OnMeasured;
            connection.Open();
        }

        /// <summary>Raised when the values to show have changed.</summary>
        public event Action Changed;

        public LinkState State { get { return connection.State; } }

        public string LastError { get { return connection.LastError; } }

        public double? PlateC { get; private set; }

        public double SetpointC { get; private set; }

        public string Faults { get; private set; }

        public void Pump()
        {
            connection.Pump();
            if (connection.Welcome != null) MaterialNames.Take(connection.Welcome.Materials);
        }

        public void Stop()
        {
            connection.Stop(Scope.All);
        }

        /// <summary>Ends at once, because the editor may be about to reload the scripts.</summary>
        public void Abort()
        {
            connection.Abort();
        }

        /// <summary>Whether the plate is simulated; null before the welcome.</summary>
        public bool? IsSimulated
        {
            get { return connection.Welcome == null ? (bool?)null : connection.Welcome.Devices.Peltier.Simulated; }
        }

        void OnDecided(Decision decision)
        {
            HapticObject shown = HapticObject.ById(decision.ObjectId);
            string label = shown != null ? shown.name : decision.ObjectId ?? "the touched region";
            Decisions.Insert(0, label + ": " + decision.Material + " (" + decision.Confidence.ToString("P0") + ", by " + decision.Source
                + Felt(decision) + "), " + decision.SetpointC.ToString("F1") + " degC");
            if (Decisions.Count > MaxDecisions) Decisions.RemoveAt(MaxDecisions);
            if (Changed != null) Changed();
        }

        static string Felt(Decision decision)
        {
            return decision.Basis == Basis.LeastError ? ", felt as " + decision.Felt : "";
        }

        void OnMeasured(Telemetry telemetry)
        {
            PlateC = telemetry.PlateC;
            SetpointC = telemetry.SetpointC;
            Faults = string.Join("; ", telemetry.Faults.ToArray());
            if (Changed != null) Changed();
        }
    }
}
