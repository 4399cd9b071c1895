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
    measure = commands.add_parser(
        "measure", help="measure latency, memory and stops of this service"
    )
    kinds = measure.add_subparsers(title="measurements", required=True, metavar="WHAT")
    latency = kinds.add_parser("latency", help="round trip of a touch, beside a bare echo")
    latency.set_defaults(run=_measure_latency)
    latency.add_argument(
        "--seconds",
        type=float,
        default=20.0,
        metavar="S",
        help="seconds for each row (%(default)s)",
    )
    latency.add_argument(
        "--vlm",
        action="store_true",
        help="also measure while a VLM with random weights uses every core",
    )
    add_json(latency)
    frames = kinds.add_parser("frames", help="60 frames/s for a minute: answers, latency, memory")
    frames.set_defaults(run=_measure_frames)
    frames.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="S",
        help="seconds to send frames for (%(default)s)",
    )
    add_json(frames)
    names = kinds.add_parser("names", help="material from names and shaders: confusion matrix")
    names.set_defaults(run=_measure_names)
    names.add_argument(
        "--data",
        type=Path,
        metavar="FOLDER",
        help="labelled pictures (../shared/data if it exists)",
    )
    add_json(names)
    beliefs = kinds.add_parser(
        "beliefs", help="what the service says and renders for held-back pictures"
    )
    beliefs.set_defaults(run=_measure_beliefs)
    beliefs.add_argument(
        "--data", type=Path, metavar="FOLDER", help="folder of labelled photographs (none)"
    )
    beliefs.add_argument(
        "--encoder", metavar="NAME_OR_FILE", help="image network (the shipped one)"
    )
    beliefs.add_argument(
        "--gallery", type=Path, metavar="GALLERY", help="gallery of that network (the shipped one)"
    )
    add_json(beliefs)
    _add_speaker(kinds)
    _add_reliability(kinds)
    _add_fleet(kinds)


def _add_reliability(kinds: Commands) -> None:
    stop = kinds.add_parser("stop", help="time from a stop to silence and to an open bridge")
    stop.set_defaults(run=_measure_stop)
    stop.add_argument(
        "--trials", type=int, default=40, metavar="N", help="stops for each condition (%(default)s)"
    )
    stop.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CONDITION",
        help="measure this condition only, repeatable (all)",
    )
    add_json(stop)
    chaos = kinds.add_parser("chaos", help="what each dying part does to the outputs, with times")
    chaos.set_defaults(run=_measure_chaos)
    chaos.add_argument(
        "--trials", type=int, default=3, metavar="N", help="how often each is hit (%(default)s)"
    )
    chaos.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="ROW",
        help="measure this row only, repeatable (all)",
    )
    add_json(chaos)
    hostile = kinds.add_parser(
        "hostile", help="round trip of touches beside each kind of hostile client"
    )
    hostile.set_defaults(run=_measure_hostile)
    hostile.add_argument(
        "--seconds",
        type=float,
        default=8.0,
        metavar="S",
        help="seconds for each kind (%(default)s)",
    )
    add_json(hostile)
    soak = kinds.add_parser("soak", help="memory and round trips over an hour of all kinds of load")
    soak.set_defaults(run=_measure_soak)
    soak.add_argument(
        "--minutes",
        type=float,
        default=60.0,
        metavar="M",
        help="minutes that it lasts (%(default)s)",
    )
    add_json(soak)


def _add_fleet(kinds: Commands) -> None:
    fleet = kinds.add_parser(
        "fleet", help="one shared recogniser for many simulated scenes (needs Ray Serve)"
    )
    fleet.set_defaults(run=_measure_fleet)
    fleet.add_argument(
        "--scenes", type=int, default=16, metavar="N", help="how many scenes (%(default)s)"
    )
    fleet.add_argument(
        "--rate",
        type=float,
        default=10.0,
        metavar="HZ",
        help="frames/s of each scene (%(default)s)",
    )
    fleet.add_argument(
        "--seconds",
        type=float,
        default=20.0,
        metavar="S",
        help="seconds for each phase (%(default)s)",
    )
    fleet.add_argument(
        "--max-age-ms",
        type=float,
        default=500.0,
        metavar="MS",
        help="answers older than this count as dropped (%(default)s)",
    )
    fleet.add_argument(
        "--batch", type=int, default=16, metavar="N", help="most crops in one batch (%(default)s)"
    )
    fleet.add_argument(
        "--replicas", type=int, default=1, metavar="N", help="how many replicas (%(default)s)"
    )
    add_json(fleet)


def _measure_fleet(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.fleet.run import Load, run

    shape = (options.scenes, options.rate, options.seconds, options.max_age_ms)
    return run(Load(*shape, options.batch, options.replicas), as_json=options.json)


def _add_speaker(kinds: Commands) -> None:
    speaker = kinds.add_parser(
        "speaker", help="delay from a contact to the first sample that an audio output plays"
    )
    speaker.set_defaults(run=_measure_speaker)
    speaker.add_argument(
        "--seconds",
        type=float,
        default=20.0,
        metavar="S",
        help="seconds for each row at a recorded audio output, 0 for none (%(default)s)",
    )
    speaker.add_argument(
        "--block",
        type=int,
        action="append",
        metavar="N",
        help="samples of a block, repeatable (64, 128, 256, 512)",
    )
    speaker.add_argument(
        "--clock",
        type=float,
        default=10.0,
        metavar="S",
        help="seconds for each row on a simulated clock (%(default)s)",
    )
    speaker.add_argument(
        "--jack",
        type=float,
        default=0.0,
        metavar="S",
        help="seconds for each block size with jackd's dummy driver (none)",
    )
    speaker.add_argument(
        "--no-realtime", dest="realtime", action="store_false", help="measure at normal priority"
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


def _measure_chaos(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.chaos import run

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
