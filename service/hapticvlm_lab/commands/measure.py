"""`hapticvlm measure`: what this service costs, floors beside figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    measure = commands.add_parser("measure", help="measure this service, floors beside figures")
    kinds = measure.add_subparsers(title="measurements", required=True, metavar="WHAT")
    latency = kinds.add_parser("latency", help="touch round trip against a bare echo")
    latency.set_defaults(run=_measure_latency)
    latency.add_argument(
        "--seconds", type=float, default=20.0, help="seconds for each row (%(default)s)"
    )
    latency.add_argument(
        "--vlm", action="store_true", help="also while a VLM (random weights) uses every core"
    )
    add_json(latency)
    frames = kinds.add_parser("frames", help="frame path at 60 frames/s: memory, queue, answers")
    frames.set_defaults(run=_measure_frames)
    frames.add_argument(
        "--seconds", type=float, default=60.0, help="how long to send (%(default)s)"
    )
    add_json(frames)
    names = kinds.add_parser("names", help="names and shaders to materials: confusion matrix")
    names.set_defaults(run=_measure_names)
    names.add_argument("--data", type=Path, help="labelled data (../shared/data if there)")
    add_json(names)
    beliefs = kinds.add_parser("beliefs", help="what is said and felt of held-back pictures")
    beliefs.set_defaults(run=_measure_beliefs)
    beliefs.add_argument("--data", type=Path, help="labelled data, for photographs (none)")
    beliefs.add_argument(
        "--encoder", metavar="NAME_OR_FILE", help="image network (the shipped one)"
    )
    beliefs.add_argument("--gallery", type=Path, help="gallery of that network (the shipped one)")
    add_json(beliefs)
    _add_speaker(kinds)
    _add_reliability(kinds)
    _add_fleet(kinds)


def _add_reliability(kinds: Commands) -> None:
    stop = kinds.add_parser("stop", help="stop to silence and to an open bridge, at the outputs")
    stop.set_defaults(run=_measure_stop)
    stop.add_argument("--trials", type=int, default=40, help="per condition (%(default)s)")
    stop.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CONDITION",
        help="measure this condition only, repeatable (all)",
    )
    add_json(stop)
    hostile = kinds.add_parser("hostile", help="touches beside each kind of hostile client")
    hostile.set_defaults(run=_measure_hostile)
    hostile.add_argument("--seconds", type=float, default=8.0, help="per kind (%(default)s)")
    add_json(hostile)
    soak = kinds.add_parser("soak", help="memory and round trips over an hour of everything")
    soak.set_defaults(run=_measure_soak)
    soak.add_argument("--minutes", type=float, default=60.0, help="how long it lasts (%(default)s)")
    add_json(soak)


def _add_fleet(kinds: Commands) -> None:
    fleet = kinds.add_parser(
        "fleet", help="many simulated scenes against one shared recogniser (extra `ray`)"
    )
    fleet.set_defaults(run=_measure_fleet)
    fleet.add_argument("--scenes", type=int, default=16, help="how many scenes (%(default)s)")
    fleet.add_argument("--rate", type=float, default=10.0, help="looks/s of each (%(default)s)")
    fleet.add_argument("--seconds", type=float, default=20.0, help="per phase (%(default)s)")
    fleet.add_argument(
        "--max-age-ms", type=float, default=500.0, help="older answers are drops (%(default)s)"
    )
    fleet.add_argument("--batch", type=int, default=16, help="most in one batch (%(default)s)")
    fleet.add_argument("--replicas", type=int, default=1, help="how many replicas (%(default)s)")
    add_json(fleet)


def _measure_fleet(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.fleet.run import Load, run

    shape = (options.scenes, options.rate, options.seconds, options.max_age_ms)
    return run(Load(*shape, options.batch, options.replicas), as_json=options.json)


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
        "--clock",
        type=float,
        default=10.0,
        metavar="S",
        help="seconds on a virtual clock (%(default)s)",
    )
    speaker.add_argument(
        "--jack",
        type=float,
        default=0.0,
        metavar="S",
        help="seconds on the dummy driver of jackd, for each block size (none)",
    )
    speaker.add_argument(
        "--no-realtime", dest="realtime", action="store_false", help="at normal priority"
    )
    add_json(speaker)


def _measure_latency(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.touch import run

    return run(seconds=options.seconds, as_json=options.json, with_vlm=options.vlm)


def _measure_frames(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.frames import run

    return run(seconds=options.seconds, as_json=options.json)


def _measure_stop(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.stop import run

    return run(trials=options.trials, only=options.only, as_json=options.json)


def _measure_hostile(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.hostile import run

    return run(seconds=options.seconds, as_json=options.json)


def _measure_soak(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.soak import run

    return run(minutes=options.minutes, as_json=options.json)


def _measure_names(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.names import run

    return run(options.data, options.json)


def _measure_beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material.beliefs import run
    from hapticvlm_lab.commands.material_wiring import labels

    chosen = options.encoder, options.gallery
    return run(options.data, labels(), *chosen, as_json=options.json)


def _measure_speaker(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.audio.speaker import BLOCKS, Plan, run

    clocks = (options.clock, options.jack)
    plan = Plan(options.seconds, options.block or BLOCKS, *clocks, options.realtime)
    return run(plan, as_json=options.json)
