"""`hapticvlm chart vibration`: modes, noise and blocks, what they cost and what a palm loses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(subjects: Commands) -> None:
    """Declare the subject."""
    vibration = subjects.add_parser(
        "vibration", help="modes, noise and block size: felt difference against cost"
    )
    vibration.set_defaults(run=_chart)
    vibration.add_argument(
        "--out",
        type=Path,
        default=Path("chart-output"),
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(vibration)


def _chart(options: argparse.Namespace) -> int:
    import matplotlib  # noqa: F401

    from hapticvlm_lab.bench.vibration import chart

    options.out.mkdir(parents=True, exist_ok=True)
    return chart.run(options.out, as_json=options.json)
