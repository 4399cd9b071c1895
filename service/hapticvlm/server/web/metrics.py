"""The status page's figures as Prometheus reads them, and whether the service is ready.

Only figures that help to watch a machine; names end in their unit, or in `_total`. Knows no part of
the service but what `/status` reports.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

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


def render(status: Mapping[str, Any]) -> str:
    """Return all figures in the text format of Prometheus."""
    return "".join(f"{line}\n" for line in _lines(status))


def _lines(status: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of each figure that there is now: its help, its type, its samples."""
    for name, (text, path) in _GAUGES.items():
        value = _at(status, path)
        if value is not None:
            yield from _head(name, "gauge", text)
            yield f"hapticvlm_{name} {value!r}"
    for name, (text, path) in _COUNTERS.items():
        yield from _head(f"{name}_total", "counter", text)
        yield f"hapticvlm_{name}_total {_at(status, path) or 0.0!r}"
    yield from _head("events_total", "counter", "drops, refusals, closes and answers by kind")
    for kind, count in sorted(status["counts"].items()):
        yield f'hapticvlm_events_total{{kind="{_escaped(kind)}"}} {float(count)!r}'
    yield from _head("fault", "gauge", "1 while this fault is there")
    for name in (*status["plate"]["faults"], *status["speaker"]["faults"]):
        yield f'hapticvlm_fault{{name="{_escaped(name)}"}} 1.0'


def _head(name: str, kind: str, text: str) -> tuple[str, str]:
    return f"# HELP hapticvlm_{name} {text}", f"# TYPE hapticvlm_{name} {kind}"


def _escaped(text: str) -> str:
    """Escape a label's value as the text format wants it."""
    return text.replace("\\", "\\\\").replace("\n", "\\n").replace('"', '\\"')


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
