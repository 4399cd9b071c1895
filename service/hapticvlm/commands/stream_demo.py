"""`hapticvlm stream` and `demo`: recorded captures as scenes."""

from __future__ import annotations

import argparse
import os
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

DEFAULT_URL = "ws://127.0.0.1:8790/"


def add(commands: Commands) -> None:
    """Declare the commands and their options."""
    _add_stream(commands)
    _add_demo(commands)


def _add_stream(commands: Commands) -> None:
    stream = commands.add_parser("stream", help="send a recorded headset capture to a service")
    stream.set_defaults(run=_stream)
    stream.add_argument("capture", type=Path, help="capture folder or video file")
    stream.add_argument("--url", default=DEFAULT_URL, help="service (%(default)s)")
    stream.add_argument("--token", help="the service's secret (HAPTICVLM_TOKEN)")
    stream.add_argument(
        "--ca", type=Path, metavar="FILE", help="trust this authority for wss://, PEM"
    )
    stream.add_argument("--eye", choices=("left", "right"), help="of a video with two side by side")
    stream.add_argument(
        "--centre",
        type=_share,
        metavar="SHARE",
        help="of a video's width and height that is touched, if no .jsonl beside it says (0.4)",
    )
    stream.add_argument("--fast", action="store_true", help="as fast as answers come back")
    stream.add_argument("--no-masks", action="store_true", help="send regions instead of masks")
    stream.add_argument("--json", action="store_true", help="print decisions as JSON lines")


def _add_demo(commands: Commands) -> None:
    demo = commands.add_parser("demo", help="stream a capture through a simulated set-up")
    demo.set_defaults(run=_demo)
    demo.add_argument("--capture", type=Path, help="capture to stream (the one in examples/)")
    demo.add_argument("--out", type=Path, default=Path("demo-output"), help="(%(default)s)")
    demo.add_argument(
        "--browser", action="store_true", help="touch the example WebXR scene yourself instead"
    )
    demo.add_argument("--quiet", action="store_true", help="no sound, even where one could play")


def _stream(options: argparse.Namespace) -> int:
    from hapticvlm.captures import Touched, View, read
    from hapticvlm.client.sending import Manner
    from hapticvlm.client.stream import Target, run

    touched = None if options.centre is None else Touched(options.centre)
    return run(
        partial(read, options.capture, View(options.eye), touched),
        Target(options.url, options.token or os.environ.get("HAPTICVLM_TOKEN"), options.ca),
        Manner(fast=options.fast, with_masks=not options.no_masks),
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
    if find_spec("matplotlib") is None:  # said before the demo runs, not after
        raise ModuleNotFoundError(name="matplotlib")
    from hapticvlm.commands.demo.run import run

    return run(options.capture, options.out, quiet=options.quiet)
