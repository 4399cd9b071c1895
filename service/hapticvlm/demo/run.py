"""Runs the main job end to end on simulated devices: a recorded headset capture becomes touch.

It starts the service in its own process, streams the capture to it as a scene would, prints each
touch while it happens, and writes a page of the session, its sound, and the recorded session.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from hapticvlm import documents
from hapticvlm.captures import Capture, Line, Recorder, read
from hapticvlm.captures.contacts import contacts
from hapticvlm.client import connect
from hapticvlm.client.connection import Client, Message
from hapticvlm.client.local_service import Service, ServiceError, ending_on_sigterm, running
from hapticvlm.client.sending import Outcome, stream
from hapticvlm.demo import CAPTURE, summary
from hapticvlm.demo.show import Show, waiting
from hapticvlm.devices.speaker.output_list import has_output
from hapticvlm.errors import HapticVLMError, shell_word
from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.recordings.page import page
from hapticvlm.recordings.page.moment import moment
from hapticvlm.recordings.timeline import Timeline
from hapticvlm.rendering.vibration import wav
from hapticvlm.rendering.vibration.sound_voice import in_voice
from hapticvlm.rendering.vibration.voices import Voices

_VOICES = {
    "sound": "It plays as sound; --voice true is for a palm speaker.",
    "true": "It plays for a palm speaker; --voice sound is for the speakers of a laptop.",
}
SETTLE_S = 0.3  # for the last answers and telemetry


def run(out: Path, *, quiet: bool, voice: str = "sound", as_json: bool = False) -> int:
    """Run the demo; return 0 when every message was answered. Raises HapticVLMError, OSError.

    The speaker and vibration.wav get `voice` (`vibration.VOICES`). With `as_json` only the summary
    is printed, as JSON at the end.
    """
    console = Console(highlight=False, soft_wrap=True, quiet=as_json)
    capture = read(CAPTURE)
    console.print(
        f"Playing a recorded session of an emulated headset ({capture.duration_s:.0f} s).\n"
        "Starting the service with a simulated plate, and your speaker if there is one.\n"
        f"{_VOICES[voice]}"
    )
    sessions = out / "session"
    sessions.mkdir(parents=True, exist_ok=True)
    with ending_on_sigterm(), _service(sessions, console, voice, quiet=quiet) as service:
        console.print(f"Ready after {service.seconds_to_ready:.1f} s.\n")
        outcome, show = _performed(capture, service, console)
    _record(show, out / "decisions.jsonl")
    session_timeline = _timeline(sessions, console)
    wav.write(out / "vibration.wav", in_voice(session_timeline.wave, voice))
    shared = moment(session_timeline)
    page.write(session_timeline, "the demo", out / "session.html", shared)
    figures = summary.write(capture, outcome, show.decisions, show.telemetry, out)
    console.print((out / "summary.txt").read_text(encoding="utf-8"))
    console.print("Results; open the page in a browser for frames, decisions, plate and sound:")
    for name in ("session.html", "vibration.wav", "decisions.jsonl", figures.name):
        console.print(f"  {out / name}")
    console.print(_next_steps(_session(sessions)))
    if sys.stdout.isatty() and not as_json:
        _show(out / "session.html", console)
    if as_json:
        sys.stdout.write(figures.read_text(encoding="utf-8"))
    return 1 if outcome.unanswered else 0


def _performed(capture: Capture, service: Service, console: Console) -> tuple[Outcome, Show]:
    """Perform the session. Raises HapticVLMError if the service ends in the middle of it."""
    try:
        return asyncio.run(_perform(capture, service, console))
    except ConnectionError as error:
        said = f"; it said: {service.printed[-1].strip()}" if service.printed else ""
        raise HapticVLMError(
            f"the service ended before the demo did{said}; run the demo again"
        ) from error


async def _perform(capture: Capture, service: Service, console: Console) -> tuple[Outcome, Show]:
    show = Show(console, capture)
    async with (
        connect(service.url, name="demo observer", role="observer") as observer,
        connect(service.url, name="demo scene") as scene,
    ):
        with show.running():
            listening = asyncio.create_task(_listen(observer, show))
            touching = asyncio.create_task(_follow(capture, show))
            outcome = await stream(scene, capture, seen=_ignore)
            await asyncio.sleep(SETTLE_S)
            for task in (listening, touching):
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await task
    return outcome, show


async def _listen(observer: Client, show: Show) -> None:
    while True:
        show.receive(await observer.events.get())


async def _follow(capture: Capture, show: Show) -> None:
    """Report each touch when it begins and ends, at the pace of the stream."""
    for touch in contacts(capture, []):
        for at_s, on_touch in (
            (touch.started_s, show.begin_touch),
            (touch.ended_s, show.end_touch),
        ):
            await asyncio.sleep(max(0.0, at_s - show.now_s))
            on_touch(touch)


def _show(path: Path, console: Console) -> None:
    """Open the page where there is a desktop; elsewhere the address is printed."""
    address = path.resolve().as_uri()
    has_desktop = sys.platform in ("win32", "darwin") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    is_open = has_desktop and webbrowser.open(address)
    console.print(f"\n{'The page is open' if is_open else 'Open the page'}: {address}")


def _ignore(line: Line, answer: Message) -> None:
    """Ignore the scene's own answers, because the observer receives every decision."""


def _record(show: Show, path: Path) -> None:
    with documents.naming(path):
        recorder = Recorder(path)
        for at, event in sorted([*show.decisions, *show.telemetry], key=lambda item: item[0]):
            recorder.write(at, event)
        recorder.close()


def _timeline(sessions: Path, console: Console) -> Timeline:
    console.print("\nReading the recorded session and rendering its vibration again.")
    with waiting(console, lambda seconds: f"rendering, {seconds:.0f} s"):
        return timeline.read(_session(sessions), MATERIALS, Voices())


def _session(sessions: Path) -> Path:
    """Return the newest session with frames; folders are named by their time."""
    folders = [folder for folder in sessions.iterdir() if (folder / "frames").is_dir()]
    if not folders:
        raise HapticVLMError(f"{sessions}: no frame was kept; is the disk full?")
    return max(folders)


@contextmanager
def _service(sessions: Path, console: Console, voice: str, *, quiet: bool) -> Iterator[Service]:
    """Start the service on a real audio output if there is one, else on the simulated speaker."""
    arguments = ["--record", str(sessions), "--record-frames"]
    heard = ["--speaker", "default", "--voice", voice]
    with contextlib.ExitStack() as stack:
        service = None
        with waiting(console, lambda seconds: f"starting, {seconds:.0f} s"):
            if not quiet and has_output():
                with contextlib.suppress(ServiceError):
                    service = stack.enter_context(running([*arguments, *heard]))
            service = service or stack.enter_context(running(arguments))
        yield service


def _next_steps(session: Path) -> str:
    return (
        "\nNext:\n"
        f"  view again  hapticvlm replay --view {shell_word(session)}\n"
        "  dashboard   hapticvlm serve, then open http://127.0.0.1:8790/ in a browser\n"
        "  pictures    http://127.0.0.1:8790/try: drop a picture of yours and touch it\n"
        "  your scene  connect it to ws://127.0.0.1:8790/ (shortest: examples/touch.py)\n"
        "  tutorials   Unity, Godot, three.js, notebook, study: docs/tutorials/"
    )
