"""`hapticvlm chart thermal` and `stability thermal`: methods to follow the skin."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

OUT = Path("chart-output")


def add_chart(subjects: Commands) -> None:
    """Declare `chart thermal`."""
    _add(subjects, "what skin feels: error against cost, every method", _chart)


def add_stability(subjects: Commands) -> None:
    """Declare `stability thermal`."""
    _add(subjects, "where each way to follow the skin breaks", _shake)


def _add(subjects: Commands, text: str, run: Callable[[argparse.Namespace], int]) -> None:
    thermal = subjects.add_parser("thermal", help=text)
    thermal.set_defaults(run=run)
    thermal.add_argument(
        "--out",
        type=Path,
        default=OUT,
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(thermal)


def _chart(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.thermal import chart

    return _into_folder(options, lambda: chart.run(options.out, as_json=options.json))


def _shake(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.thermal import stability

    return _into_folder(options, lambda: stability.run(options.out, as_json=options.json))


def _into_folder(options: argparse.Namespace, run: Callable[[], int]) -> int:
    import matplotlib  # noqa: F401

    options.out.mkdir(parents=True, exist_ok=True)
    return run()
