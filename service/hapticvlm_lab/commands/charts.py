"""`hapticvlm chart` and `stability`: the worth and the cost of each method, and what breaks it.

Another subject is one more call of `_subject`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib import import_module
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

Arguments = Callable[[argparse.Namespace], tuple[object, ...]]


def add(commands: Commands) -> None:
    """Declare both commands with their subjects."""
    chart = commands.add_parser("chart", help="draw accuracy against latency for every method")
    subjects = chart.add_subparsers(title="subjects", required=True, metavar="WHAT")
    material = _material(
        subjects, "material.chart", LIMIT, lambda of: (_where(of), of.encoder or ())
    )
    material.add_argument(
        "--encoder",
        action="append",
        metavar="NAME",
        help="network to chart, named as for `serve --encoder`, repeatable (those beside the data)",
    )
    text = "skin temperature: error of each method against computing time"
    _subject(subjects, "thermal", "thermal", text)
    text = "modes and block size: perceptible difference against computing time"
    _subject(subjects, "vibration", "vibration.chart", text)
    text = "whole pipelines: objects recognised by touch, against processor time"
    whole = _subject(subjects, "whole", "whole.chart", text, lambda of: (_data(of), of.kits))
    labelled_pictures(whole)
    whole.add_argument(
        "--kits",
        type=Path,
        metavar="FOLDER",
        help="game kits, drawn there by `python -m hapticvlm_lab.training --only held-back` (none)",
    )
    stability = commands.add_parser("stability", help="draw under which conditions a method fails")
    subjects = stability.add_subparsers(title="subjects", required=True, metavar="WHAT")
    _material(subjects, "material.stability", PERTURBED, lambda of: (_where(of),))
    text = "decisions kept in fog, bars, foveation and other ways to take and show a picture"
    conventions = _subject(
        subjects, "conventions", "material.conventions", text, lambda of: (of.folder, of.limit)
    )
    conventions.add_argument("folder", type=Path, metavar="FOLDER", help="folder of pictures")
    number(conventions, "--limit", PERTURBED, "N", "at most so many pictures, 0 for all")
    text = "a touch beside other work: when it is late"
    _subject(subjects, "latency", "latency.stability", text)


def _subject(
    subjects: Commands, name: str, module: str, text: str, arguments: Arguments = lambda _: ()
) -> argparse.ArgumentParser:
    """Declare a subject: `run` of a module of bench/, called with these arguments and --out.

    The folder is created when it runs.
    """

    def run(options: argparse.Namespace) -> int:
        import matplotlib  # noqa: F401 - if it is missing, fail before anything is computed

        options.out.mkdir(parents=True, exist_ok=True)
        bench = import_module(f"hapticvlm_lab.bench.{module}")
        code: int = bench.run(*arguments(options), options.out, as_json=options.json)
        return code

    subject: argparse.ArgumentParser = subjects.add_parser(name, help=text)
    subject.set_defaults(run=run)
    subject.add_argument(
        "--out",
        type=Path,
        default=OUT,
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(subject)
    return subject


def _material(
    subjects: Commands, module: str, limit: int, arguments: Arguments
) -> argparse.ArgumentParser:
    text = "material from pictures, for each held-back source"
    material = _subject(subjects, "material", module, text, arguments)
    labelled_pictures(material)
    number(material, "--limit", limit, "N", "at most so many pictures of each source, 0 for all")
    return material


def _where(options: argparse.Namespace) -> Where:
    from hapticvlm_lab.bench.material.data import Where

    return Where(_data(options), options.limit)


def _data(options: argparse.Namespace) -> Path | None:
    """Return the folder of labelled data, None without one."""
    from hapticvlm_lab.bench.material.data import SIBLING

    folder: Path = options.data or SIBLING
    return folder if (folder / "labels.csv").is_file() else None
