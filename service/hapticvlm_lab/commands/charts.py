"""`hapticvlm chart` and `stability`: what each method is worth, what it costs, what breaks it.

Another subject is one more `_subject`.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm_lab.commands.declaring import labelled_pictures, number
from hapticvlm_studio.commands.evaluate import TOKEN

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_lab.bench.material.data import Where

OUT = Path("chart-output")
LIMIT = 640  # pictures of a source that `chart` uses
SHAKEN = 64  # pictures of a source that `stability` uses
PLATES = 200

Run = Callable[[argparse.Namespace], int]


def add(commands: Commands) -> None:
    """Declare the commands, with a subject each."""
    chart = commands.add_parser("chart", help="draw accuracy against latency for every method")
    subjects = chart.add_subparsers(title="subjects", required=True, metavar="WHAT")
    material = _material(subjects, _chart_material, LIMIT)
    material.add_argument(
        "--encoder",
        action="append",
        metavar="NAME",
        help="network to chart, named as for `serve --encoder`, repeatable (those beside the data)",
    )
    beliefs = _subject(
        subjects,
        "beliefs",
        _chart_beliefs,
        "what the service says and renders for pictures, and what it learns from a few",
    )
    labelled_pictures(beliefs)
    _subject(
        subjects,
        "thermal",
        _chart_thermal,
        "skin temperature: error against computing time for every method",
    )
    _ambient(subjects)
    _safety(subjects)
    _subject(
        subjects,
        "vibration",
        _chart_vibration,
        "modes, noise and block size: perceptible difference against computing time",
    )
    whole = _subject(
        subjects,
        "whole",
        _chart_whole,
        "whole pipelines: objects felt as what they are against time of a core",
    )
    labelled_pictures(whole)
    stability = commands.add_parser("stability", help="draw under which conditions a method fails")
    subjects = stability.add_subparsers(title="subjects", required=True, metavar="WHAT")
    _material(subjects, _shake_material, SHAKEN)
    _subject(subjects, "thermal", _shake_thermal, "skin temperature: where each method fails")
    _subject(subjects, "latency", _shake_latency, "a touch beside other work: when it is late")


def _subject(subjects: Commands, name: str, run: Run, text: str) -> argparse.ArgumentParser:
    """Declare a subject that writes into a folder, which is made when it runs."""

    def into_folder(options: argparse.Namespace) -> int:
        import matplotlib  # noqa: F401 - missing, it is named before anything is computed

        options.out.mkdir(parents=True, exist_ok=True)
        return run(options)

    subject: argparse.ArgumentParser = subjects.add_parser(name, help=text)
    subject.set_defaults(run=into_folder)
    subject.add_argument(
        "--out",
        type=Path,
        default=OUT,
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(subject)
    return subject


def _material(subjects: Commands, run: Run, limit: int) -> argparse.ArgumentParser:
    material = _subject(
        subjects, "material", run, "material from pictures, for each held-back source"
    )
    labelled_pictures(material)
    material.add_argument(
        "--capture",
        type=Path,
        action="append",
        metavar="DIR",
        help="capture whose materials are known, repeatable (those in examples/)",
    )
    number(material, "--limit", limit, "N", "most pictures of each source, 0 for all")
    return material


def _ambient(subjects: Commands) -> None:
    ambient = _subject(
        subjects, "ambient", _chart_ambient, "air temperature from pictures: error, time, memory"
    )
    ambient.add_argument(
        "--data", type=Path, metavar="CSV", help="labelled pictures, as `evaluate ambient` takes"
    )
    ambient.add_argument(
        "--model",
        metavar="NAME_OR_FOLDER",
        help="name or folder of a model (one with random weights)",
    )
    ambient.add_argument(
        "--random",
        choices=["tiny", "full"],
        default="tiny",
        help="size of the random model; full is that of Qwen2-VL-2B, 5 GB (%(default)s)",
    )
    ambient.add_argument(
        "--vlm-device",
        default="cpu",
        metavar="NAME",
        help="where the model runs: cpu or cuda (%(default)s)",
    )
    ambient.add_argument("--vlm-url", metavar="URL", help="chart an OpenAI-compatible endpoint too")


def _safety(subjects: Commands) -> None:
    safety = _subject(
        subjects,
        "safety",
        _chart_safety,
        "safety functions of the plate: peak temperature, false trips, time to off",
    )
    number(safety, "--plates", PLATES, "N", "how many plates to vary")
    safety.add_argument(
        "--sweep",
        type=Path,
        metavar="FILE",
        help="time to off for each fault, as tests/firmware/sweep.py writes it",
    )


def _chart_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import chart

    named = options.encoder or ()
    return chart.run(_where(options), named, options.out, as_json=options.json)


def _shake_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import stability

    return stability.run(_where(options), options.out, as_json=options.json)


def _chart_beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import belief_chart

    return belief_chart.run(_data(options), options.out, as_json=options.json)


def _chart_thermal(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.thermal import chart

    return chart.run(options.out, as_json=options.json)


def _shake_latency(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency import stability

    return stability.run(options.out, as_json=options.json)


def _shake_thermal(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.thermal import stability

    return stability.run(options.out, as_json=options.json)


def _chart_ambient(options: argparse.Namespace) -> int:
    import transformers  # noqa: F401 - missing, it is named before anything is computed

    from hapticvlm_lab.bench.ambient import chart

    plan = chart.Plan(
        data=options.data,
        model=options.model,
        size=options.random,
        device=options.vlm_device,
        url=options.vlm_url,
        token=os.environ.get(TOKEN),
        out=options.out,
        as_json=options.json,
    )
    return chart.run(plan)


def _chart_safety(options: argparse.Namespace) -> int:
    from hapticvlm.errors import usage_errors
    from hapticvlm_lab.bench.safety import chart

    with usage_errors():
        return chart.run(options.plates, options.out, options.sweep, as_json=options.json)


def _chart_vibration(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.vibration import chart

    return chart.run(options.out, as_json=options.json)


def _chart_whole(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.whole import chart

    return chart.run(_data(options), options.out, as_json=options.json)


def _where(options: argparse.Namespace) -> Where:
    from hapticvlm_lab.bench.material.data import Where
    from hapticvlm_lab.bench.material.reading import default_captures

    captures = tuple(options.capture) if options.capture else default_captures()
    return Where(captures, _data(options), options.limit)


def _data(options: argparse.Namespace) -> Path | None:
    """Return the folder of labelled data, None without one."""
    from hapticvlm_lab.bench.names import SIBLING

    folder: Path = options.data or SIBLING
    return folder if (folder / "labels.csv").is_file() else None
