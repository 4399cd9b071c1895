"""The main job, end to end, on simulated devices: a recorded headset capture becomes touch.

Starts the service in a process of its own, streams the capture to it as a scene would, shows what
it decides while it decides it, and leaves a folder to look at and listen to.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from hapticvlm.captures import Capture, CaptureError, Line, Recorder, read
from hapticvlm.client import connect
from hapticvlm.client.connection import Client, Message
from hapticvlm.client.sending import Outcome, stream
from hapticvlm.commands.demo import report
from hapticvlm.commands.local_service import Service, ServiceError, running

DEFAULT_CAPTURE = "examples/captures/living_room"
REFRESH_HZ = 8
ROWS = 16


class Show:
    """What the observer has heard so far, as a live table."""

    def __init__(self, capture: Capture) -> None:
        self._capture = capture
        self._started = time.monotonic()
        self.decisions: list[tuple[float, Message]] = []
        self.telemetry: list[tuple[float, Message]] = []
        self._newest: dict[str, tuple[float, Message]] = {}
        self._names = report.names(capture)

    def begin(self) -> None:
        """Count time from now."""
        self._started = time.monotonic()

    def take(self, event: Message) -> None:
        """Keep one event of the service."""
        at = time.monotonic() - self._started
        if event["type"] == "telemetry":
            self.telemetry.append((at, event))
        elif event["type"] == "decision":
            self.decisions.append((at, event))
            object_id = event.get("object_id") or "the view"
            self._newest.pop(object_id, None)
            self._newest[object_id] = (at, event)

    def __rich__(self) -> Group:
        """Draw the table and the outputs."""
        now = time.monotonic() - self._started
        table = Table(title=f"{self._capture.path.name}: what the service decides")
        for column in ("object", "material", "sure", "source", "setpoint", "age"):
            table.add_column(column, justify="right" if column in ("sure", "age") else "left")
        for object_id, (at, decision) in list(self._newest.items())[-ROWS:]:
            limited = f" ({decision['limited_by']} limit)" if decision.get("limited_by") else ""
            table.add_row(
                self._names.get(object_id, object_id),
                decision["material"],
                f"{decision['confidence']:.0%}",
                decision["source"],
                f"{decision['setpoint_c']:.1f} degC{limited}",
                f"{now - at:.1f} s",
            )
        return Group(table, self._outputs(now))

    def _outputs(self, now: float) -> Text:
        if not self.telemetry:
            return Text("waiting for the first telemetry")
        newest = self.telemetry[-1][1]
        bar = "#" * min(30, int(60 * newest["speaker_level"]))
        return Text(
            f"{now:5.1f} / {self._capture.duration_s:.1f} s   plate {newest['plate_c']:5.2f} degC"
            f" (setpoint {newest['setpoint_c']:5.2f})   vibration {bar}"
        )


def run(path: Path | None, out: Path, *, quiet: bool) -> int:
    """Run the demo; return 0 when every message was answered."""
    console = Console()
    capture = read(path if path is not None else _shipped())
    out.mkdir(parents=True, exist_ok=True)
    with _service(out, quiet) as service:
        console.print(f"service ready after {service.seconds_to_ready:.2f} s, simulated plate")
        outcome, show = asyncio.run(_perform(capture, service, out, console))
    with console.status("drawing what happened"):
        files = report.write(capture, outcome, show.decisions, show.telemetry, out)
    console.print()
    console.print((out / "summary.txt").read_text(encoding="utf-8"), highlight=False)
    for file in files:
        console.print(f"  {file}", highlight=False)
    console.print(_next_steps(), highlight=False)
    return 1 if outcome.unanswered else 0


async def _perform(
    capture: Capture, service: Service, out: Path, console: Console
) -> tuple[Outcome, Show]:
    show = Show(capture)
    async with (
        connect(service.url, name="demo observer", role="observer") as observer,
        connect(service.url, name="demo scene") as scene,
    ):
        with Live(show, console=console, refresh_per_second=REFRESH_HZ):
            listening = asyncio.create_task(_listen(observer, show))
            show.begin()
            outcome = await stream(scene, capture, seen=_ignore)
            await asyncio.sleep(0.3)
            listening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await listening
    _record(show, out / "decisions.jsonl")
    return outcome, show


async def _listen(observer: Client, show: Show) -> None:
    while True:
        show.take(await observer.events.get())


def _ignore(line: Line, answer: Message) -> None:
    """Leave the scene's own answers to their count: the observer hears everything."""


def _record(show: Show, path: Path) -> None:
    recorder = Recorder(path)
    for at, event in sorted([*show.decisions, *show.telemetry], key=lambda item: item[0]):
        recorder.write(at, event)
    recorder.close()


@contextmanager
def _service(out: Path, quiet: bool) -> Iterator[Service]:
    """Start the service on a real output if there is one, else on the simulated speaker."""
    arguments = ["--wav", str(out / "vibration.wav")]
    with contextlib.ExitStack() as stack:
        service = None
        if not quiet:
            with contextlib.suppress(ServiceError):
                service = stack.enter_context(running([*arguments, "--speaker", "default"]))
        yield service or stack.enter_context(running(arguments))


def _shipped() -> Path:
    beside = (Path.cwd(), Path(__file__).resolve().parents[4])
    for folder in beside:
        if (folder / DEFAULT_CAPTURE).is_dir():
            return folder / DEFAULT_CAPTURE
    raise CaptureError(f"no {DEFAULT_CAPTURE} here: name one with --capture")


def _next_steps() -> str:
    return (
        "\nNext:\n"
        "  dashboard   hapticvlm serve, then open http://127.0.0.1:8790/ in a browser\n"
        "  your scene  connect it to ws://127.0.0.1:8790/ (examples/touch.py is the shortest one)\n"
        "  Unity       add the package in unity_client/ (README.md there: five steps);\n"
        "              schemas/messages.schema.json and schemas/vectors/ are the contract"
    )
