"""`hapticvlm replay` runs a recorded session again without hardware."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import touch_options
from hapticvlm.commands.parsing import add_json
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.evidence.ladder import Evidence
    from hapticvlm.messages import Frame
    from hapticvlm.recordings.log_player import Recognise, Replayed


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    replay = commands.add_parser(
        "replay",
        help="run a recorded session again and compare every output",
        description="Run a recorded session again, without hardware, and report whether every "
        "output is the same bit for bit. Exit code 1: an output differs, or lines are missing.",
        examples=(
            "hapticvlm replay demo-output    the session of `hapticvlm demo`",
            "hapticvlm replay sessions/2026-01-31-120000-1 --recognise",
            "hapticvlm replay sessions/2026-01-31-120000-1 --share --out felt.html",
        ),
    )
    replay.set_defaults(run=_replay)
    replay.add_argument(
        "folder",
        type=Path,
        metavar="SESSION",
        help="folder of a session, or of several: the newest",
    )
    replay.add_argument(
        "--gallery",
        type=Path,
        metavar="GALLERY",
        help="gallery that the service had (the shipped one)",
    )
    replay.add_argument(
        "--encoder",
        metavar="NAME_OR_FILE",
        help="image network for --recognise, as in `serve` (the shipped one)",
    )
    replay.add_argument(
        "--recognise",
        action="store_true",
        help="recognise the kept frames again and count the differences; needs a session recorded "
        "with --record-frames",
    )
    replay.add_argument(
        "--wav", type=Path, metavar="FILE", help="write the vibration to this WAV file"
    )
    touch_options.add_voice(replay, "true", "voice of --wav (true)")
    replay.add_argument(
        "--view",
        action="store_true",
        help="write a page that shows the session over time, and open it (in a terminal)",
    )
    replay.add_argument(
        "--share",
        action="store_true",
        help="write a page to send on: it opens at one moment (--at, or the strongest vibration) "
        "and has its title and picture",
    )
    replay.add_argument(
        "--out", type=Path, metavar="FILE", help="page to write (session.html in SESSION)"
    )
    replay.add_argument("--at", type=float, metavar="S", help="open the page at this time")
    touch_options.add_recordings(replay)
    add_json(replay)


def _replay(options: argparse.Namespace) -> int:
    from hapticvlm.recordings.session_log import newest_session

    options.folder = newest_session(options.folder)
    if options.view or options.share:
        return _view(options)
    from hapticvlm.recordings import replay

    with usage_errors():
        table = touch_options.table(options.gallery)
        recogniser = _recogniser(options) if options.recognise else None
        outcome = replay.replay(options.folder, table, recogniser)
        if options.wav is not None:
            from hapticvlm.rendering.vibration import wav
            from hapticvlm.rendering.vibration.sound_voice import in_voice

            wave = replay.waveform(outcome, touch_options.voices(options, table))
            wav.write(options.wav, in_voice(wave, options.voice))
    if options.json:
        print(json.dumps(_fields(outcome, recognised=options.recognise)))
    else:
        _print(outcome, recognised=options.recognise)
    return 0 if outcome.is_same or options.recognise else 1


def _view(options: argparse.Namespace) -> int:
    """Write the page of a session; open it if this runs in a terminal."""
    import webbrowser

    from hapticvlm.recordings import timeline
    from hapticvlm.recordings.page import page
    from hapticvlm.recordings.page.moment import moment

    with usage_errors():
        table = touch_options.table(options.gallery)
        voices = touch_options.voices(options, table)
        session = timeline.read(options.folder, table, voices, page.LONGEST_S)
    path = options.out or options.folder / "session.html"
    shared = moment(session, options.at) if options.share else None
    page.write(session, page.safe_name(options.folder), path, shared)
    address = page.at(path, options.at)
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB\n{address}", flush=True)
    if sys.stdout.isatty() and not webbrowser.open(address):
        print("no browser was opened; open the address in one")
    return 0


def _recogniser(options: argparse.Namespace) -> Recognise:
    """Load an encoder and a gallery; return a function that recognises pictures with them."""
    from hapticvlm.recordings.session_log import SessionLogError
    from hapticvlm.vision.frame_recogniser import FrameRecogniser
    from hapticvlm.vision.galleries.storage import load_gallery
    from hapticvlm.vision.loading import load_encoder

    encoder = load_encoder(options.encoder)
    recogniser = FrameRecogniser(encoder, load_gallery(options.gallery, encoder=encoder))

    def recognise(picture: Frame, subject: str) -> Evidence:
        result = recogniser.recognise(picture, subject, 0.0, force=True)
        if result.evidence is None:
            raise SessionLogError(
                f"{options.folder}: {result.error}; --recognise needs the frames kept"
            )
        return result.evidence

    return recognise


def _print(outcome: Replayed, *, recognised: bool) -> None:
    counts = ", ".join(f"{count} {name}" for name, count in sorted(outcome.counts.items()))
    print(f"{outcome.lines} lines: {counts}")
    if outcome.missing:
        print(f"the session log is incomplete: {outcome.missing} lines are missing")
    if not outcome.differing:
        rest = " of the lines that are there" if outcome.missing else ""
        print(f"{outcome.outputs} outputs{rest}, every one bit for bit as recorded")
        return
    why = "the evidence is not bit for bit the recorded one" if recognised else "NOT as recorded"
    print(f"{outcome.outputs} outputs, {outcome.differing} groups of them differ ({why})")
    print(f"first: {outcome.first_difference}")


def _verdict(outcome: Replayed, *, recognised: bool) -> str:
    """Return the result in a word; of frames recognised again their materials are compared.

    Evidence may differ in its last digits, from another processor or without the references of the
    scene's other objects, and the outputs with it.
    """
    name = "recognised differently"
    if outcome.counts[name] if recognised else outcome.differing:
        return "differs"
    return "incomplete" if outcome.missing else "same"


def _fields(outcome: Replayed, *, recognised: bool) -> dict[str, object]:
    return {
        "replay": _verdict(outcome, recognised=recognised),
        "lines": outcome.lines,
        "missing": outcome.missing,
        "outputs": outcome.outputs,
        "differing": outcome.differing,
        "counts": dict(outcome.counts),
    }
