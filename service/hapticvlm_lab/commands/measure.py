"""`hapticvlm measure`: what this service costs, floors beside figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    measure = commands.add_parser("measure", help="measure this service, floors beside figures")
    kinds = measure.add_subparsers(title="measurements", required=True, metavar="WHAT")
    latency = kinds.add_parser("latency", help="touch round trip against a bare echo")
    latency.set_defaults(run=_measure_latency)
    latency.add_argument("--seconds", type=float, default=20.0, help="per row (%(default)s)")
    latency.add_argument(
        "--vlm", action="store_true", help="also while a VLM (random weights) uses every core"
    )
    latency.add_argument("--json", action="store_true", help="print the JSON line only")
    frames = kinds.add_parser("frames", help="frame path at 60 frames/s: memory, queue, answers")
    frames.set_defaults(run=_measure_frames)
    frames.add_argument("--seconds", type=float, default=60.0, help="(%(default)s)")
    frames.add_argument("--json", action="store_true", help="print the JSON line only")
    names = kinds.add_parser("names", help="names and shaders to materials: confusion matrix")
    names.set_defaults(run=_measure_names)
    names.add_argument("--data", type=Path, help="labelled data (../shared/data if there)")
    names.add_argument("--json", action="store_true", help="print the JSON line only")
    beliefs = kinds.add_parser("beliefs", help="what is said and felt of held-back pictures")
    beliefs.set_defaults(run=_measure_beliefs)
    beliefs.add_argument("--data", type=Path, help="labelled data, for photographs (none)")
    beliefs.add_argument("--encoder", metavar="NAME_OR_FOLDER", help="(the one shipped)")
    beliefs.add_argument("--gallery", type=Path, help="its gallery (the one shipped)")
    beliefs.add_argument("--json", action="store_true", help="print the JSON line only")
    _add_speaker(kinds)


def _add_speaker(kinds: Commands) -> None:
    speaker = kinds.add_parser(
        "speaker", help="contact to first sample at a recorded sink, beside a bare audio program"
    )
    speaker.set_defaults(run=_measure_speaker)
    speaker.add_argument(
        "--seconds", type=float, default=20.0, help="per row at the sink (%(default)s; 0 = none)"
    )
    speaker.add_argument(
        "--block", type=int, action="append", help="block size (repeatable; 64, 128, 256, 512)"
    )
    speaker.add_argument(
        "--clock", type=float, default=10.0, metavar="S", help="of virtual clock (%(default)s)"
    )
    speaker.add_argument(
        "--jack", type=float, default=0.0, metavar="S", help="of jackd's dummy, per block (none)"
    )
    speaker.add_argument(
        "--no-realtime", dest="realtime", action="store_false", help="at normal priority"
    )
    speaker.add_argument("--json", action="store_true", help="print the JSON line only")


def _measure_latency(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.touch import run

    return run(seconds=options.seconds, as_json=options.json, with_vlm=options.vlm)


def _measure_frames(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.frames import run

    return run(seconds=options.seconds, as_json=options.json)


def _measure_names(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.names import run

    return run(options.data, options.json)


def _measure_beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material.beliefs import run
    from hapticvlm_lab.commands.charts import labels

    chosen = options.encoder, options.gallery
    return run(options.data, labels(), *chosen, as_json=options.json)


def _measure_speaker(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.audio.speaker import BLOCKS, Plan, run

    clocks = (options.clock, options.jack)
    plan = Plan(options.seconds, options.block or BLOCKS, *clocks, options.realtime)
    return run(plan, as_json=options.json)
