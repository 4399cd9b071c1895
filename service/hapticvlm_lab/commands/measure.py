"""`hapticvlm measure`: what this service costs, floors beside figures."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm_lab.commands.declaring import labelled_pictures, number, only

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

Run = Callable[[argparse.Namespace], int]


def add(commands: Commands) -> None:
    """Declare the command and its measurements."""
    measure = commands.add_parser(
        "measure", help="measure latency, memory and stops of this service"
    )
    kinds = measure.add_subparsers(title="measurements", required=True, metavar="WHAT")
    _add_latency(kinds)
    _add_recognition(kinds)
    _add_speaker(kinds)
    _add_reliability(kinds)
    _add_fleet(kinds)
    marks = _kind(kinds, "marks", _marks, "the figures that the project holds itself to")
    marks.add_argument("--write", action="store_true", help="put the table into docs/MEASURED.md")


def _kind(kinds: Commands, name: str, run: Run, text: str) -> argparse.ArgumentParser:
    kind: argparse.ArgumentParser = kinds.add_parser(name, help=text)
    kind.set_defaults(run=run)
    add_json(kind)
    return kind


def _add_latency(kinds: Commands) -> None:
    latency = _kind(kinds, "latency", _latency, "round trip of a touch, beside a bare echo")
    number(latency, "--seconds", 20.0, "S", "seconds for each row")
    latency.add_argument(
        "--vlm",
        action="store_true",
        help="also measure while a VLM with random weights uses every core",
    )
    turns = _kind(kinds, "turns", _turns, "how long each turn of the gateway's loop holds it")
    number(turns, "--seconds", 10.0, "S", "seconds to send touches and frames for")
    frames = _kind(kinds, "frames", _frames, "60 frames/s for a minute: answers, latency, memory")
    number(frames, "--seconds", 60.0, "S", "seconds to send frames for")


def _add_recognition(kinds: Commands) -> None:
    names = _kind(kinds, "names", _names, "material from names and shaders: confusion matrix")
    labelled_pictures(names)
    beliefs = _kind(
        kinds, "beliefs", _beliefs, "what the service says and renders for held-back pictures"
    )
    beliefs.add_argument(
        "--data", type=Path, metavar="FOLDER", help="folder of labelled photographs (none)"
    )
    beliefs.add_argument(
        "--encoder", metavar="NAME_OR_FILE", help="image network (the shipped one)"
    )
    beliefs.add_argument(
        "--gallery", type=Path, metavar="GALLERY", help="gallery of that network (the shipped one)"
    )


def _add_reliability(kinds: Commands) -> None:
    stop = _kind(kinds, "stop", _stop, "time from a stop to silence and to an open bridge")
    number(stop, "--trials", 40, "N", "stops for each condition")
    only(stop, "condition")
    chaos = _kind(kinds, "chaos", _chaos, "what each dying part does to the outputs, with times")
    number(chaos, "--trials", 3, "N", "how often each is hit")
    only(chaos, "row")
    hostile = _kind(
        kinds, "hostile", _hostile, "round trip of touches beside each kind of hostile client"
    )
    number(hostile, "--seconds", 8.0, "S", "seconds for each kind")
    soak = _kind(kinds, "soak", _soak, "memory and round trips over an hour of all kinds of load")
    number(soak, "--minutes", 60.0, "M", "minutes that it lasts")
    invariants = _kind(
        kinds, "invariants", _invariants, "what must hold beside random clients, kills and freezes"
    )
    number(invariants, "--minutes", 10.0, "M", "minutes that it lasts")
    number(invariants, "--seed", 0, "N", "seed of what the clients do")


def _add_fleet(kinds: Commands) -> None:
    fleet = _kind(
        kinds,
        "fleet",
        _fleet,
        "one shared recogniser for many simulated scenes",
    )
    fleet.add_argument(
        "--engine",
        choices=("uvicorn", "ray"),
        default="uvicorn",
        help="what serves it (%(default)s)",
    )
    number(fleet, "--scenes", 16, "N", "how many scenes")
    number(fleet, "--rate", 10.0, "HZ", "frames/s of each scene")
    number(fleet, "--seconds", 20.0, "S", "seconds for each phase")
    number(fleet, "--max-age-ms", 500.0, "MS", "answers older than this count as dropped")
    number(fleet, "--batch", 16, "N", "most crops in one batch")
    number(fleet, "--replicas", 1, "N", "how many replicas")


def _add_speaker(kinds: Commands) -> None:
    speaker = _kind(
        kinds,
        "speaker",
        _speaker,
        "delay from a contact to the first sample that an audio output plays",
    )
    number(
        speaker, "--seconds", 20.0, "S", "seconds for each row at a recorded audio output, 0: none"
    )
    speaker.add_argument(
        "--block",
        type=int,
        action="append",
        metavar="N",
        help="samples of a block, repeatable (64, 128, 256, 512)",
    )
    number(speaker, "--clock", 10.0, "S", "seconds for each row on a simulated clock")
    number(speaker, "--jack", 0.0, "S", "seconds for each block size with jackd's dummy driver")
    speaker.add_argument(
        "--no-realtime", dest="realtime", action="store_false", help="measure at normal priority"
    )


def _fleet(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.fleet.run import Load, run

    shape = (options.scenes, options.rate, options.seconds, options.max_age_ms)
    return run(Load(*shape, options.batch, options.replicas, options.engine), as_json=options.json)


def _latency(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.touch import run

    return run(seconds=options.seconds, as_json=options.json, with_vlm=options.vlm)


def _turns(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.turns import run

    return run(seconds=options.seconds, as_json=options.json)


def _frames(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency.frames import run

    return run(seconds=options.seconds, as_json=options.json)


def _stop(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.stop import run

    return run(trials=options.trials, only=options.only, as_json=options.json)


def _chaos(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.chaos import run

    return run(trials=options.trials, only=options.only, as_json=options.json)


def _hostile(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.hostile import run

    return run(seconds=options.seconds, as_json=options.json)


def _soak(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.soak import run

    return run(minutes=options.minutes, as_json=options.json)


def _invariants(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.invariants import run

    return run(minutes=options.minutes, seed=options.seed, as_json=options.json)


def _marks(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.marks import run

    return run(write=options.write, as_json=options.json)


def _names(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.names import run

    return run(options.data, options.json)


def _beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material.beliefs import run

    return run(options.data, options.encoder, options.gallery, as_json=options.json)


def _speaker(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.audio.speaker import BLOCKS, Plan, run

    clocks = (options.clock, options.jack)
    plan = Plan(options.seconds, options.block or BLOCKS, *clocks, options.realtime)
    return run(plan, as_json=options.json)
