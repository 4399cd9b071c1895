"""Asks the sound server whether an output is muted or turned down: the usual cause of no vibration.

The program of the system is asked: pactl (PulseAudio and PipeWire), wpctl (PipeWire without it) or
osascript (macOS); the last two know the default output only. Where none of them is installed, or it
does not know the output, the volume is unknown, which is not a fault. pactl also knows the volume
of our own stream, which sound servers remember for all later runs.
"""

from __future__ import annotations

import os
import re
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass

LOW = 0.25  # share of full volume; PulseAudio's is cubic, so this is -36 dB
ASK_S = 2.0  # until a program that does not answer is given up
WATCH_S = 2.5  # between two questions while the service runs

_DEFAULT = "default"
_FIELD = re.compile(r"^\t(Name|Description|Mute|Volume): (.*)$", re.MULTILINE)
_PERCENT = re.compile(r"(\d+)%")
_WPCTL = re.compile(r"Volume: (\d+(?:\.\d+)?)( \[MUTED\])?")
_OSASCRIPT = re.compile(r"output volume:(\d+).*output muted:(true|false)")

Run = Callable[..., str | None]


@dataclass(frozen=True, slots=True)
class Volume:
    """The state of an output: muted or not, and its volume as a share (0..1)."""

    muted: bool
    share: float

    @property
    def is_low(self) -> bool:
        """Whether hardly anything is felt at this volume."""
        return self.muted or self.share < LOW

    @property
    def text(self) -> str:
        """The state in words."""
        return "muted" if self.muted else f"at {self.share * 100:.0f} % of its volume"


def volume_of(output: str, run: Run | None = None, pid: int | None = None) -> Volume | None:
    """Return the volume of an output by the name under which it is listed; None if unknown.

    With `pid` it is the volume of what this process plays there, where pactl knows that. Any name
    that begins with "default" is the default output. Blocks for up to ASK_S per program.
    """
    run = run or _run
    is_default = output.lower().startswith(_DEFAULT)
    sinks = run("pactl", "list", "sinks")
    if sinks:
        info = run("pactl", "info") if is_default else None
        sink = from_pactl(sinks, _default_sink(info or "") if is_default else output)
        if sink is None or pid is None:
            return sink
        return _through(sink, run("pactl", "list", "sink-inputs") or "", pid)
    if not is_default:
        return None
    if said := run("wpctl", "get-volume", "@DEFAULT_AUDIO_SINK@"):
        return from_wpctl(said)
    return from_osascript(run("osascript", "-e", "get volume settings") or "")


def from_pactl(sinks: str, name: str) -> Volume | None:
    """Read `pactl list sinks`; `name` is the sink's name or description."""
    for sink in re.split(r"^Sink #", sinks, flags=re.MULTILINE):
        fields = dict(_FIELD.findall(sink))
        if name in (fields.get("Name"), fields.get("Description")):
            return _volume(fields)
    return None


def _through(sink: Volume, streams: str, pid: int) -> Volume:
    """Return the volume of a sink with that of a process's stream, of `pactl list sink-inputs`."""
    for stream in streams.split("Sink Input #"):
        own = _volume(dict(_FIELD.findall(stream)))
        if own is not None and f'application.process.id = "{pid}"' in stream:
            return Volume(sink.muted or own.muted, sink.share * own.share)
    return sink


def _volume(fields: dict[str, str]) -> Volume | None:
    channels = [int(percent) / 100.0 for percent in _PERCENT.findall(fields.get("Volume", ""))]
    return Volume(fields.get("Mute") == "yes", max(channels)) if channels else None


def from_wpctl(said: str) -> Volume | None:
    """Read `wpctl get-volume`."""
    match = _WPCTL.search(said)
    return None if match is None else Volume(match[2] is not None, float(match[1]))


def from_osascript(said: str) -> Volume | None:
    """Read macOS's `get volume settings`."""
    match = _OSASCRIPT.search(said)
    return None if match is None else Volume(match[2] == "true", int(match[1]) / 100.0)


class VolumeWatch:
    """Asks for the volume of one output every WATCH_S, in a thread of its own."""

    def __init__(
        self, output: str, ask: Callable[[str], Volume | None] = volume_of, every_s: float = WATCH_S
    ) -> None:
        """Start watching."""
        self.volume: Volume | None = None
        self._output = output
        self._ask = ask
        self._every_s = every_s
        self._ending = threading.Event()
        threading.Thread(target=self._watch, name="volume", daemon=True).start()

    def close(self) -> None:
        """Ask no more; does not wait for an answer that is due."""
        self._ending.set()

    def _watch(self) -> None:
        while not self._ending.is_set():
            self.volume = self._ask(self._output)
            self._ending.wait(self._every_s)


def _default_sink(info: str) -> str:
    match = re.search(r"^Default Sink: (.+)$", info, re.MULTILINE)
    return match[1] if match else ""


def _run(*command: str) -> str | None:
    """Return what a program prints, in English; None if it is not there, fails or hangs."""
    try:
        result = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=ASK_S,
            check=False,
            env={**os.environ, "LC_ALL": "C"},
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return result.stdout if result.returncode == 0 else None
