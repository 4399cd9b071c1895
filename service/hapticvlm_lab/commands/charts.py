"""`hapticvlm chart` and `stability`: the worth and the cost of each method, and what breaks it.

Another subject is one more call of `_subject`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm_lab.commands.declaring import labelled_pictures, number

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_lab.bench.material.data import Where

OUT = Path("chart-output")
LIMIT = 640  # pictures of a source that `chart` uses
PERTURBED = 64  # pictures of a source that `stability` uses

Run = Callable[[argparse.Namespace], int]


def add(commands: Commands) -> None:
    """Declare both commands with their subjects."""
    chart = commands.add_parser("chart", help="draw accuracy against latency for every method")
    subjects = chart.add_subparsers(title="subjects", required=True, metavar="WHAT")
    material = _material(subjects, _chart_material, LIMIT)
    material.add_argument(
        "--encoder",
        action="append",
        metavar="NAME",
        help="network to chart, named as for `serve --encoder`, repeatable (those beside the data)",
    )
    _subject(
        subjects,
        "thermal",
        _chart_thermal,
        "skin temperature: error of each method against computing time",
    )
    _subject(
        subjects,
        "vibration",
        _chart_vibration,
        "modes and block size: perceptible difference against computing time",
    )
    whole = _subject(
        subjects,
        "whole",
        _chart_whole,
        "whole pipelines: objects recognised by touch, against processor time",
    )
    labelled_pictures(whole)
    whole.add_argument(
        "--kits",
        type=Path,
        metavar="FOLDER",
        help="game kits, drawn there by `python -m hapticvlm_lab.training.kits` (none)",
    )
    stability = commands.add_parser("stability", help="draw under which conditions a method fails")
    subjects = stability.add_subparsers(title="subjects", required=True, metavar="WHAT")
    _material(subjects, _perturb_material, PERTURBED)
    conventions = _subject(
        subjects,
        "conventions",
        _perturb_conventions,
        "decisions kept in fog, bars, foveation and other ways to take and show a picture",
    )
    conventions.add_argument("folder", type=Path, metavar="FOLDER", help="folder of pictures")
    number(conventions, "--limit", PERTURBED, "N", "at most so many pictures, 0 for all")
    _subject(subjects, "latency", _perturb_latency, "a touch beside other work: when it is late")


def _subject(subjects: Commands, name: str, run: Run, text: str) -> argparse.ArgumentParser:
    """Declare a subject that writes into a folder, which is created when it runs."""

    def into_folder(options: argparse.Namespace) -> int:
        import matplotlib  # noqa: F401 - if it is missing, fail before anything is computed

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
    number(material, "--limit", limit, "N", "at most so many pictures of each source, 0 for all")
    return material


def _chart_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import chart

    named = options.encoder or ()
    return chart.run(_where(options), named, options.out, as_json=options.json)


def _perturb_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import stability

    return stability.run(_where(options), options.out, as_json=options.json)


def _perturb_conventions(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import conventions

    return conventions.run(options.folder, options.out, options.limit, as_json=options.json)


def _chart_thermal(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench import thermal

    return thermal.run(options.out, as_json=options.json)


def _perturb_latency(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.latency import stability

    return stability.run(options.out, as_json=options.json)


def _chart_vibration(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.vibration import chart

    return chart.run(options.out, as_json=options.json)


def _chart_whole(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.whole import chart

    return chart.run(_data(options), options.kits, options.out, as_json=options.json)


def _where(options: argparse.Namespace) -> Where:
    from hapticvlm_lab.bench.material.data import Where

    return Where(_data(options), options.limit)


def _data(options: argparse.Namespace) -> Path | None:
    """Return the folder of labelled data, None without one."""
    from hapticvlm_lab.bench.material.data import SIBLING

    folder: Path = options.data or SIBLING
    return folder if (folder / "labels.csv").is_file() else None
