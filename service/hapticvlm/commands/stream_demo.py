"""`hapticvlm stream` and `demo`: recorded captures as scenes."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import reaching
from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


_STREAM = """
Send a recorded VR session to a running service, as a scene would. The decisions are printed as
they change. Exit code 1: a message had no answer or was an error; 2: the service or the capture
could not be used.
"""
_DEMO = """
Play a recorded VR session through a service with simulated devices. Each touch prints a line.
The folder then holds a film with sound, the record, pictures of touches and plate, and the
vibration as a WAV file.
"""


def add(commands: Commands) -> None:
    """Declare the commands and their options."""
    _add_stream(commands)
    _add_demo(commands)


def _add_stream(commands: Commands) -> None:
    stream = commands.add_parser(
        "stream",
        help="send a recorded VR session to a running service",
        description=_STREAM,
        examples=(
            "hapticvlm stream examples/captures/living_room",
            "hapticvlm stream headset.mp4 --eye left --centre 0.3",
        ),
    )
    stream.set_defaults(run=_stream)
    stream.add_argument(
        "capture", type=Path, metavar="CAPTURE", help="a capture folder, or a video file"
    )
    reaching.add_options(stream)
    stream.add_argument(
        "--eye",
        choices=("left", "right"),
        help="the video shows both eyes side by side: use this half",
    )
    stream.add_argument(
        "--centre",
        type=_share,
        metavar="SHARE",
        help="without a .jsonl file beside the video, the middle of the picture is touched: this "
        "share of its width and height (0.4)",
    )
    stream.add_argument(
        "--fast", action="store_true", help="send as fast as the service answers, not in real time"
    )
    stream.add_argument(
        "--no-masks", action="store_true", help="say where an object is by a rectangle, not a mask"
    )
    add_json(stream)


def _add_demo(commands: Commands) -> None:
    demo = commands.add_parser(
        "demo",
        help="see it work on simulated devices",
        description=_DEMO,
        examples=("hapticvlm demo", "hapticvlm demo --browser"),
    )
    demo.set_defaults(run=_demo)
    demo.add_argument(
        "--capture", type=Path, metavar="CAPTURE", help="the session to play (one of the package)"
    )
    demo.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        default=Path("demo-output"),
        help="folder for the results (%(default)s)",
    )
    demo.add_argument(
        "--browser",
        action="store_true",
        help="open a WebXR scene in the browser and touch it yourself",
    )
    demo.add_argument("--quiet", action="store_true", help="play no sound")


def _stream(options: argparse.Namespace) -> int:
    from hapticvlm.captures import Touched, View, read
    from hapticvlm.client.sending import Pace
    from hapticvlm.client.stream import run

    touched = None if options.centre is None else Touched(options.centre)
    return run(
        partial(read, options.capture, View(options.eye), touched),
        reaching.target(options),
        Pace(fast=options.fast, with_masks=not options.no_masks),
        as_json=options.json,
    )


def _share(text: str) -> float:
    share = float(text)
    if not 0.0 < share <= 1.0:
        raise argparse.ArgumentTypeError(f"{text}: a share of the picture, above 0 and at most 1")
    return share


def _demo(options: argparse.Namespace) -> int:
    if options.browser:
        from hapticvlm.commands.demo import browser

        return browser.run()
    print("hapticvlm demo: loading", flush=True)
    from hapticvlm.commands.progress import working

    with working("loading"):  # a second, and many where nothing was compiled before
        from hapticvlm.commands.demo.run import run

    return run(options.capture, options.out, quiet=options.quiet)
