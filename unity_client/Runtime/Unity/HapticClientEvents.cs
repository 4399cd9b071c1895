using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>What the service says, raised on the main thread.</summary>
    public sealed partial class HapticClient
    {
        public event Action<Decision> Decided;
        public event Action<Telemetry> Measured;
        public event Action<LinkState> LinkChanged;

        /// <summary>This scene is felt from now on, or no longer: one scene owns the outputs of a service.</summary>
        public event Action<bool> OwnershipChanged;

        /// <summary>What a hand feels from now on, where a Controller Haptics asked for it.</summary>
        public event Action<Vibration> Vibrated;

        void Follow(Dispatcher arrivals)
        {
            arrivals.Decided += OnDecided;
            arrivals.Measured += OnMeasured;
            arrivals.Vibrated += OnVibrated;
            arrivals.Refused += OnRefused;
            arrivals.Failed += OnFailed;
            arrivals.StateChanged += OnStateChanged;
            arrivals.OwnershipChanged += OnOwnershipChanged;
        }

        void OnDecided(Decision decision)
        {
            HapticObject target;
            if (decision.ObjectId != null && objects.TryGetValue(decision.ObjectId, out target)) target.Take(decision);
            if (Decided != null) Decided(decision);
            onDecision.Invoke(decision);
        }

        void OnMeasured(Telemetry telemetry)
        {
            if (Measured != null) Measured(telemetry);
            onTelemetry.Invoke(telemetry);
        }

        void OnVibrated(Vibration vibration)
        {
            if (awaitsStop && vibration.Stopped != true) return; // it was on its way when the stop was sent
            awaitsStop = false;
            if (Vibrated != null) Vibrated(vibration);
        }

        void OnRefused(Error error)
        {
            log.Refused(error.Code + ": " + error.Text, this);
        }

        void OnFailed(Exception error)
        {
            log.Failed(error, this);
        }

        void OnStateChanged(LinkState state)
        {
            if (state == LinkState.Ready) UnknownMaterials.Warn(objects.Values, connection);
            else ControllerHaptics.SilenceAll();
            awaitsStop = false;
            if (LinkChanged != null) LinkChanged(state);
            onLinkChanged.Invoke(state);
        }

        void OnOwnershipChanged(bool isOwner)
        {
            if (!isOwner) ControllerHaptics.SilenceAll();
            awaitsStop = false; // what a stop is answered with goes to the owner alone
            log.Owned(isOwner, this);
            if (OwnershipChanged != null) OwnershipChanged(isOwner);
        }
    }
}
