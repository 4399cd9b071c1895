"""`hapticvlm record` and `replay`: keep a session, and run it again without hardware."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import voice_options
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.commands.replay import Replayed
    from hapticvlm.recognition.frame_recogniser import FrameRecogniser


def add(commands: Commands) -> None:
    """Declare the commands and their options; `record` has all of `serve` too."""
    from hapticvlm.commands import serve

    record = commands.add_parser("record", help="run the service and keep each session in a folder")
    record.add_argument("record", type=Path, metavar="FOLDER", help="a sub-folder a session")
    serve.add_options(record, but=("record",))
    replay = commands.add_parser("replay", help="run a recorded session again, bit for bit")
    replay.set_defaults(run=_replay)
    replay.add_argument("folder", type=Path, help="of one session, as `record` made it")
    replay.add_argument("--gallery", type=Path, help="as the service had (what is shipped)")
    replay.add_argument("--encoder", help="with --recognise: as for serve (the one shipped)")
    replay.add_argument(
        "--recognise",
        action="store_true",
        help="look at the kept frames anew and report what differs",
    )
    replay.add_argument("--wav", type=Path, help="write the vibration to this file")
    voice_options.add_options(replay)
    replay.add_argument("--json", action="store_true", help="print the JSON line only")


def _replay(options: argparse.Namespace) -> int:
    from hapticvlm.commands import replay
    from hapticvlm.recognition.galleries.user_materials import read_folder, table_with

    with usage_errors():
        table = table_with(read_folder(options.gallery))
        recogniser = _recogniser(options) if options.recognise else None
        outcome = replay.replay(options.folder, table, recogniser)
        if options.wav is not None:
            from hapticvlm.devices.audio import write_wav

            write_wav(options.wav, replay.waveform(outcome, voice_options.voices(options, table)))
    if not options.json:
        _say(outcome, recognised=options.recognise)
    print(json.dumps(_fields(outcome)))
    return 0 if outcome.is_same or options.recognise else 1


def _recogniser(options: argparse.Namespace) -> FrameRecogniser:
    from hapticvlm.recognition.encoders.loading import load_encoder
    from hapticvlm.recognition.frame_recogniser import FrameRecogniser
    from hapticvlm.recognition.galleries.storage import load_gallery

    encoder = load_encoder(options.encoder)
    return FrameRecogniser(encoder, load_gallery(options.gallery, encoder=encoder))


def _say(outcome: Replayed, *, recognised: bool) -> None:
    counts = ", ".join(f"{count} {name}" for name, count in sorted(outcome.counts.items()))
    print(f"{outcome.lines} lines: {counts}")
    if outcome.missing:
        print(f"the session log is incomplete: {outcome.missing} lines are missing")
    if outcome.is_same:
        print(f"{outcome.outputs} outputs, every one bit for bit as recorded")
        return
    why = "recognised anew" if recognised else "NOT as recorded"
    print(f"{outcome.outputs} outputs, {outcome.differing} groups of them differ ({why})")
    print(f"first: {outcome.first_difference}")


def _fields(outcome: Replayed) -> dict[str, object]:
    return {
        "replay": "same" if outcome.is_same else "differs",
        "lines": outcome.lines,
        "missing": outcome.missing,
        "outputs": outcome.outputs,
        "differing": outcome.differing,
        "counts": dict(outcome.counts),
    }
