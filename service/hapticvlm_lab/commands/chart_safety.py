"""`hapticvlm chart safety`: what the guards of the plate are worth."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

PLATES = 200


def add(subjects: Commands) -> None:
    """Declare the subject."""
    safety = subjects.add_parser(
        "safety", help="the plate's guards: peak temperature, false trips, time to off"
    )
    safety.set_defaults(run=_chart)
    safety.add_argument("--plates", type=int, default=PLATES, help="variations (%(default)s)")
    safety.add_argument(
        "--sweep", type=Path, metavar="FILE", help="time to off per fault, of the compiled binary"
    )
    safety.add_argument(
        "--out",
        type=Path,
        default=Path("chart-output"),
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(safety)


def _chart(options: argparse.Namespace) -> int:
    import matplotlib  # noqa: F401

    from hapticvlm.errors import usage_errors
    from hapticvlm_lab.bench.safety import chart

    options.out.mkdir(parents=True, exist_ok=True)
    with usage_errors():
        return chart.run(chart.Plan(options.plates, options.out, options.sweep, options.json))
