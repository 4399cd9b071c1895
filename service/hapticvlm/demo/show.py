"""Prints the service's decisions as they are made: a row for each touch, and a live status line."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.text import Text

from hapticvlm.captures import Capture
from hapticvlm.captures.contacts import Contact
from hapticvlm.client.connection import Message

SOURCES = {
    "scene": "the scene says so",
    "name": "by its name",
    "shader": "by its shader",
    "texture": "by its texture",
    "encoder": "by its picture",
    "vlm": "by the VLM",
    "unknown": "not sure enough",
}
REFRESH_HZ = 8
SILENCE_S = 2.0  # longest silence before progress is printed, where the output is not a terminal
_COLUMNS = "{:>5}  {:<21} {:<13} {:<16} {:>5} {:>8} {:>5}"
_HEAD = (
    _COLUMNS.format("time", "object", "material", "evidence", "skin", "setpoint", "plate")
    + "\n"
    + _COLUMNS.format("s", "", "", "", "degC", "degC", "degC")
)
_LEGEND = (
    "skin: temperature that skin should feel. setpoint: target of the plate when the\n"
    "touch ended. plate: its temperature then (simulated)."
)


def degrees(decision: Mapping[str, Any]) -> str:
    """Return the temperature for skin: `skin should feel 23.9 °C`."""
    contact_c = decision.get("contact_c")
    return "" if contact_c is None else f"skin should feel {contact_c:.1f} °C"


@contextmanager
def waiting(console: Console, text: Callable[[float], str]) -> Iterator[None]:
    """Print a line every SILENCE_S until the context ends; `text` makes it from the seconds."""
    began = time.monotonic()
    ended = threading.Event()

    def report_progress() -> None:
        while not ended.wait(SILENCE_S):
            console.print(f"  {text(time.monotonic() - began)}")

    thread = threading.Thread(target=report_progress, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class Show:
    """Prints touches and status, and keeps the events the observer has received."""

    def __init__(self, console: Console, capture: Capture) -> None:
        self._console = console
        self._duration_s = capture.duration_s
        self._started = self._printed_at = time.monotonic()
        self._newest: dict[str, Message] = {}
        self._touched: str | None = None
        self.decisions: list[tuple[float, Message]] = []
        self.telemetry: list[tuple[float, Message]] = []

    @property
    def now_s(self) -> float:
        """Seconds since the stream began."""
        return time.monotonic() - self._started

    @contextmanager
    def running(self) -> Iterator[None]:
        """Count time from now, and show the status line until the context ends."""
        self._started = time.monotonic()
        self._print(_HEAD)
        with Live(
            get_renderable=self._status,
            console=self._console,
            refresh_per_second=REFRESH_HZ,
            transient=True,
        ):
            yield
        self._print(_LEGEND)

    def receive(self, event: Message) -> None:
        """Record one event of the service."""
        if event["type"] == "telemetry":
            self.telemetry.append((self.now_s, event))
            if not self._console.is_terminal and time.monotonic() - self._printed_at > SILENCE_S:
                self._print(f"{self._status()}")
        elif event["type"] == "decision":
            self.decisions.append((self.now_s, event))
            if event.get("object_id") is not None:
                self._newest[event["object_id"]] = event

    def begin_touch(self, touch: Contact) -> None:
        """Show the touched object in the status line."""
        self._touched = touch.name

    def end_touch(self, touch: Contact) -> None:
        """Print the row of a touch that has ended."""
        self._touched = None
        decision = self._newest.get(touch.object_id)
        newest = self.telemetry[-1][1] if self.telemetry else {}
        self._print(row(touch, decision, newest))

    def _print(self, text: str) -> None:
        self._printed_at = time.monotonic()
        self._console.print(text)

    def _status(self) -> Text:
        if not self.telemetry:
            return Text("waiting for the first telemetry")
        newest = self.telemetry[-1][1]
        touched = f"touching {self._touched}" if self._touched else "no touch"
        bar = "#" * min(12, int(24 * newest["speaker_level"]))
        return Text(
            f"{self.now_s:5.1f} of {self._duration_s:.0f} s  {touched:<31}"
            f"plate {_degrees(newest['plate_c'])}  {bar}"
        )


def row(touch: Contact, decision: Message | None, telemetry: Message) -> str:
    """Return one touch as a row of at most 80 columns: object, material, evidence, temperatures."""
    if decision is None:
        return _COLUMNS.format(f"{touch.started_s:.1f}", touch.name[:21], "undecided", *[""] * 4)
    material = decision["material"]
    if material != "unknown" and decision["source"] != "scene":
        material += f" {decision['confidence']:.0%}"
    return _COLUMNS.format(
        f"{touch.started_s:.1f}",
        touch.name[:21],
        material,
        SOURCES[decision["source"]],
        _degrees(decision.get("contact_c")),
        _degrees(telemetry.get("setpoint_c")),
        _degrees(telemetry.get("plate_c")),
    )


def _degrees(celsius: float | None) -> str:
    return "-" if celsius is None else f"{celsius:.1f}"
