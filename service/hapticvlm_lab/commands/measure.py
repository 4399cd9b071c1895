"""`hapticvlm measure`: the costs of this service, each figure beside its floor."""

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
    _add_shared_recogniser(kinds)
    _kind(kinds, "touches", _touches, "how well a simulated palm tells the materials apart")
    marks = _kind(kinds, "marks", _marks, "the figures that the project has marks for")
    marks.add_argument("--write", action="store_true", help="write the table into docs/figures.md")


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
    turns = _kind(kinds, "turns", _turns, "duration of each turn of the gateway's event loop")
    number(turns, "--seconds", 10.0, "S", "seconds of touches and frames")
    frames = _kind(kinds, "frames", _frames, "60 frames/s for a minute: answers, latency, memory")
    number(frames, "--seconds", 60.0, "S", "seconds of frames")


def _add_recognition(kinds: Commands) -> None:
    names = _kind(kinds, "names", _names, "material from names and shaders: confusion matrix")
    labelled_pictures(names)
    names.add_argument(
        "--csv",
        type=Path,
        metavar="FILE",
        help="names of real scenes instead, with the columns scene, name, expected",
    )
    beliefs = _kind(
        kinds,
        "beliefs",
        _beliefs,
        "materials that the service names and renders for held-back pictures",
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
    invariants = _kind(
        kinds,
        "invariants",
        _invariants,
        "what must hold beside random and hostile clients, kills, freezes",
    )
    number(invariants, "--minutes", 10.0, "M", "minutes of random clients, 0: none")
    number(invariants, "--seed", 0, "N", "seed of the random requests")
    number(
        invariants,
        "--flood-seconds",
        8.0,
        "S",
        "seconds of touches beside each kind of hostile client, 0: none",
    )


def _add_shared_recogniser(kinds: Commands) -> None:
    shared = _kind(
        kinds,
        "shared-recogniser",
        _shared_recogniser,
        "one shared recogniser for many simulated scenes",
    )
    shared.add_argument(
        "--engine",
        choices=("uvicorn", "ray"),
        default="uvicorn",
        help="server to run it on (%(default)s)",
    )
    number(shared, "--scenes", 16, "N", "number of scenes")
    number(shared, "--rate", 10.0, "HZ", "frames/s of each scene")
    number(shared, "--seconds", 20.0, "S", "seconds for each phase")
    number(shared, "--max-age-ms", 500.0, "MS", "answers older than this count as dropped")
    number(shared, "--batch", 16, "N", "most crops in one batch")
    number(shared, "--replicas", 1, "N", "number of replicas")


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
    number(speaker, "--clock", 10.0, "S", "seconds on the virtual clock, 0: none")
    speaker.add_argument(
        "--no-realtime", dest="realtime", action="store_false", help="measure at normal priority"
    )


def _shared_recogniser(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.shared_recogniser import Load, run

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


def _invariants(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.invariants import run

    return run(
        minutes=options.minutes,
        seed=options.seed,
        flood_seconds=options.flood_seconds,
        as_json=options.json,
    )


def _touches(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.vibration.telling_apart import run

    return run(as_json=options.json)


def _marks(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.marks import run

    return run(write=options.write, as_json=options.json)


def _names(options: argparse.Namespace) -> int:
    if options.csv is not None:
        from hapticvlm_lab.bench.scene_names import run as run_scenes

        return run_scenes(options.csv, options.json)
    from hapticvlm_lab.bench.names import run

    return run(options.data, options.json)


def _beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material.beliefs import run

    return run(options.data, options.encoder, options.gallery, as_json=options.json)


def _speaker(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.audio import BLOCKS, Plan, run

    plan = Plan(options.seconds, options.block or BLOCKS, options.clock, options.realtime)
    return run(plan, as_json=options.json)
