"""The status page's figures as Prometheus reads them, and whether the service is ready.

Only figures that help to watch a machine; names end in their unit, or in `_total`. Knows no part of
the service but what `/status` reports.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

TYPE = "text/plain; version=0.0.4; charset=utf-8"
_GAUGES = {
    "connections": ("open connections", ("connections",)),
    "leases": ("hands that hold a lease", ("leases",)),
    "speaker_level": ("rms of the newest block", ("speaker", "level")),
    "plate_celsius": ("temperature of the plate", ("plate", "plate_c")),
    "setpoint_celsius": ("setpoint of the plate", ("plate", "setpoint_c")),
    "dose_cem43_minutes": ("thermal dose", ("plate", "dose_cem43")),
}
_COUNTERS = {
    "underruns": ("audio blocks that came too late", ("speaker", "underruns")),
    "lost_commands": ("commands the audio engine missed", ("speaker", "lost_commands")),
    "engine_restarts": ("restarts of the audio engine", ("speaker", "restarts")),
    "recogniser_restarts": ("restarts of the recogniser", ("recogniser", "restarts")),
    "recogniser_busy_seconds": ("time spent recognising", ("recogniser", "busy_s")),
    "shared_recogniser_answered": (
        "crops that the shared recogniser recognised",
        ("recogniser", "remote", "answered"),
    ),
    "shared_recogniser_failed": ("its failures", ("recogniser", "remote", "failed")),
    "vlm_answered": ("answers of the vision-language model", ("vlm", "answered")),
    "vlm_failed": ("its failures", ("vlm", "failed")),
}


class _StatusCollector(Collector):
    def __init__(self, status: Mapping[str, Any]) -> None:
        self._status = status

    def collect(self) -> Iterable[Metric]:
        """Yield each figure that there is now."""
        for name, (text, path) in _GAUGES.items():
            value = _at(self._status, path)
            if value is not None:
                yield GaugeMetricFamily(f"hapticvlm_{name}", text, value)
        for name, (text, path) in _COUNTERS.items():
            yield CounterMetricFamily(f"hapticvlm_{name}", text, _at(self._status, path) or 0)
        events = CounterMetricFamily(
            "hapticvlm_events", "drops, refusals, closes and answers by kind", labels=["kind"]
        )
        for kind, count in sorted(self._status["counts"].items()):
            events.add_metric([kind], count)
        yield events
        faults = GaugeMetricFamily(
            "hapticvlm_fault", "1 while this fault is there", labels=["name"]
        )
        for name in (*self._status["plate"]["faults"], *self._status["speaker"]["faults"]):
            faults.add_metric([name], 1)
        yield faults


def render(status: Mapping[str, Any]) -> str:
    """Return all figures in the text format of Prometheus."""
    # A registry of its own for each request: the library's global one would add figures of the
    # Python process and would need counters that are kept in two places.
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_StatusCollector(status))
    return generate_latest(registry).decode()


def obstacles(status: Mapping[str, Any]) -> list[str]:
    """Return what keeps the service from rendering touches and recognising frames now."""
    found = []
    if not status["speaker"]["plays"]:
        found.append("the audio engine does not play")
    if not status["recogniser"]["ready"]:
        found.append("the recogniser is not loaded")
    return found + [f"fault {name}" for name in status["plate"]["faults"]]


def _at(status: Mapping[str, Any], path: tuple[str, ...]) -> float | None:
    value: Any = status
    for key in path:
        value = None if value is None else value.get(key)
    return None if value is None else float(value)
