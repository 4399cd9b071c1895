"""Asks the sound server what becomes of the samples for an output on their way to the hand.

Muted, turned down, played on another output, or on one with nothing plugged in: each of these is
felt as nothing, and the audio interface reports none of them. The program of the system is asked:
pactl (PulseAudio and PipeWire), wpctl (PipeWire without it) or osascript (macOS); the last two know
the volume of the default output only. Where none of them is installed, or it does not know the
output, the state is unknown, which is not a fault. pactl also knows our own stream, whose volume
sound servers remember for all later runs.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass

from hapticvlm.devices.faults import SPEAKER_LOW, SPEAKER_UNREACHED, Fault
from hapticvlm.devices.speaker.channels import Channels

APP_NAME = "HapticVLM"  # under which our stream is listed
DUMMY = "auto_null"  # a sound server's own output where there is none
LOW = 0.25  # share of full volume; PulseAudio's is cubic, so this is -36 dB
ASK_S = 2.0  # until a program that does not answer is given up
WATCH_S = 2.0  # between two questions while the service runs

_DEFAULT = "default"
_ITEM = re.compile(r"^(?:Sink|Sink Input) #(\d+)$", re.MULTILINE)
_FIELD = re.compile(
    r"^\t(Name|Description|Mute|Volume|Channel Map|Sink|Active Port): (.*)$", re.MULTILINE
)
_DEFAULT_SINK = re.compile(r"^Default Sink: (.+)$", re.MULTILINE)
_PERCENT = re.compile(r"(\d+)%")
_WPCTL = re.compile(r"Volume: (\d+(?:\.\d+)?)( \[MUTED\])?")
_OSASCRIPT = re.compile(r"output volume:(\d+).*output muted:(true|false)")

Run = Callable[..., str | None]
Fields = dict[str, str]  # of a sink or a stream, as pactl lists it; `text` is all of it


@dataclass(frozen=True, slots=True)
class OutputState:
    """The volume (0..1) of the channels in use, what keeps samples from them, and all channels."""

    muted: bool
    share: float
    obstacle: str = ""
    channel_map: tuple[str, ...] = ()

    @property
    def fault(self) -> Fault | None:
        """Why nothing is felt, or hardly anything; None if it is."""
        if self.obstacle:
            return SPEAKER_UNREACHED
        return SPEAKER_LOW if self.muted or self.share < LOW else None

    @property
    def text(self) -> str:
        """The state in words that follow "is"."""
        if self.obstacle:
            return self.obstacle
        return "muted" if self.muted else f"at {self.share * 100:.0f} % of its volume"


def output_state(
    output: str, run: Run | None = None, pid: int | None = None, hands: Channels | None = None
) -> OutputState | None:
    """Return the state of an output by one of its names; None if unknown.

    With it goes the state of what the process `pid` plays there, or any service (None), where pactl
    knows that. `hands` are the channels in use; None are all. Any name that begins with "default"
    is the default output. Blocks for up to ASK_S per program.
    """
    run = run or _run
    is_default = output.lower().startswith(_DEFAULT)
    if listed := run("pactl", "list", "sinks"):
        sinks = _items(listed)
        default = _DEFAULT_SINK.search(run("pactl", "info") or "") if is_default else None
        name = default[1] if default else output
        names = ("Name", "Description")
        chosen = next((s for s in sinks.values() if name in map(s.get, names)), None)
        stream = _stream(run("pactl", "list", "sink-inputs") or "", pid)
        sink = chosen if stream is None else sinks.get(stream.get("Sink", ""), chosen)
        moved = None not in (chosen, sink) and sink is not chosen and not is_default
        return None if sink is None else _state(sink, stream, hands, moved=moved)
    if not is_default:
        return None
    if said := _WPCTL.search(run("wpctl", "get-volume", "@DEFAULT_AUDIO_SINK@") or ""):
        return OutputState(said[2] is not None, float(said[1]))
    said = _OSASCRIPT.search(run("osascript", "-e", "get volume settings") or "")
    return None if said is None else OutputState(said[2] == "true", int(said[1]) / 100.0)


def _state(
    sink: Fields, stream: Fields | None, hands: Channels | None, *, moved: bool
) -> OutputState | None:
    sides = [sink] if stream is None else [sink, stream]
    share = math.prod(_share(side, hands) for side in sides)
    channel_map, ours = (
        tuple(each.get("Channel Map", "").split(",")) for each in (sink, sides[-1])
    )
    in_use = () if hands is None or len(ours) < hands.min_count else (hands.left, hands.right)
    obstacle = ""
    if sink.get("Name") == DUMMY:
        obstacle = "missing: the sound server plays into nothing instead"
    elif moved:
        obstacle = f"not used: the sound server plays on {sink.get('Description')} instead"
    elif stream and not {ours[n - 1] for n in in_use} <= {*channel_map}:
        theirs = ", ".join(channel_map)
        obstacle = f"not reached: its channels are {theirs}, those of our stream {', '.join(ours)}"
    elif _is_unplugged(sink):
        obstacle = "without a listener: nothing is plugged into it"
    muted = any(side.get("Mute") == "yes" for side in sides)
    return None if math.isnan(share) else OutputState(muted, share, obstacle, channel_map)


def _is_unplugged(sink: Fields) -> bool:
    """Return whether the output's socket reports that nothing is plugged in."""
    port = re.escape(sink.get("Active Port", "none"))
    return re.search(rf"^\t\t{port}: .*not available", sink["text"], re.MULTILINE) is not None


def _items(listed: str) -> dict[str, Fields]:
    """Read what pactl lists: the fields of each sink or stream by its number."""
    _, *parts = _ITEM.split(listed)
    texts = zip(parts[::2], parts[1::2], strict=True)
    return {number: {**dict(_FIELD.findall(text)), "text": text} for number, text in texts}


def _stream(listed: str, pid: int | None) -> Fields | None:
    """Return the stream of a process, or without one that of any service."""
    known = f'process.id = "{pid}"' if pid is not None else f'application.name = "{APP_NAME}"'
    return next((each for each in _items(listed).values() if known in each["text"]), None)


def _share(side: Fields, hands: Channels | None) -> float:
    """Return the volume of the loudest channel, or of the hand that gets less; NaN if unknown."""
    shares = [int(percent) / 100.0 for percent in _PERCENT.findall(side.get("Volume", ""))]
    if hands is None or len(shares) < hands.min_count:
        return max(shares, default=math.nan)
    return min(shares[hands.left - 1], shares[hands.right - 1])


class OutputWatch:
    """Asks for the state of an output every WATCH_S, in a thread of its own."""

    def __init__(self, ask: Callable[[], OutputState | None], every_s: float = WATCH_S) -> None:
        """Start watching."""
        self.state: OutputState | None = None
        self._ask = ask
        self._every_s = every_s
        self._ending = threading.Event()
        threading.Thread(target=self._watch, name="output state", daemon=True).start()

    def close(self) -> None:
        """Ask no more; does not wait for an answer that is due."""
        self._ending.set()

    def _watch(self) -> None:
        while not self._ending.is_set():
            self.state = self._ask() or self.state  # a busy system may not answer in time
            self._ending.wait(self._every_s)


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
