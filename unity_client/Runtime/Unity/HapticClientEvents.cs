using System;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>The events of the service, raised on the main thread.</summary>
    public sealed partial class HapticClient
    {
        public event Action<Decision> Decided;
        public event Action<Telemetry> Measured;
        public event Action<LinkState> LinkChanged;

        /// <summary>This scene gained or lost the outputs; one scene owns the outputs of a service at a time.</summary>
        public event Action<bool> OwnershipChanged;

        /// <summary>The vibration of one hand from now on, of the service or the bake; raised if a Controller Haptics requested it.</summary>
        public event Action<Vibration> Vibrated;

        /// <summary>The service refused a message; the console has the text, too, once.</summary>
        public event Action<Error> Refused;

        /// <summary>A part of the scene was left out or changed; the rest is felt. The console has the text, too, once.</summary>
        public event Action<LeftOut> LeftOut;

        void Follow(Dispatcher arrivals)
        {
            arrivals.Decided += OnDecided;
            arrivals.Measured += OnMeasured;
            arrivals.Vibrated += OnVibrated;
            arrivals.Refused += OnRefused;
            arrivals.LeftOut += OnLeftOut;
            arrivals.TexturesWanted += textures.Want;
            arrivals.Failed += error => log.Failed(error, this);
            arrivals.StateChanged += OnStateChanged;
            arrivals.OwnershipChanged += OnOwnershipChanged;
        }

        void OnDecided(Decision decision)
        {
            surfaces.Decide(decision);
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
            if (isStopPending && vibration.Stopped != true) return; // it was in transit when the stop was sent
            isStopPending = false;
            felt.Serve(vibration);
        }

        void OnRefused(Error error)
        {
            log.Refused(error.Code + ": " + error.Text, this);
            if (Refused != null) Refused(error);
        }

        void OnLeftOut(LeftOut part)
        {
            log.LeftOut(part.Path, part.Text, this);
            if (LeftOut != null) LeftOut(part);
        }

        void OnStateChanged(LinkState state)
        {
            if (state == LinkState.Ready) UnknownMaterials.Warn(objects.Values, connection);
            else if (mode == FeltMode.Service || (mode == FeltMode.Auto && state == LinkState.Closed)) ControllerHaptics.SilenceAll(); // else the bake goes on
            isStopPending = false;
            if (LinkChanged != null) LinkChanged(state);
            onLinkChanged.Invoke(state);
        }

        void OnOwnershipChanged(bool isOwner)
        {
            if (!isOwner && (mode == FeltMode.Service || State == LinkState.Ready)) ControllerHaptics.SilenceAll();
            isStopPending = false; // only the owner receives the answer to a stop
            log.Owned(isOwner, this);
            if (OwnershipChanged != null) OwnershipChanged(isOwner);
        }
    }
}
