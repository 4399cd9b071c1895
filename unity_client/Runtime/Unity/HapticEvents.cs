using System;
using HapticVLM.Wire;
using UnityEngine.Events;

namespace HapticVLM
{
    [Serializable]
    public sealed class DecisionEvent : UnityEvent<Decision> { }

    [Serializable]
    public sealed class TelemetryEvent : UnityEvent<Telemetry> { }

    [Serializable]
    public sealed class LinkEvent : UnityEvent<LinkState> { }
}
