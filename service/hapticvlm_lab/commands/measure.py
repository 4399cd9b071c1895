"""`hapticvlm measure`: the costs of this service, each figure beside its floor."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm_lab.commands.declaring import number

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

Run = Callable[[argparse.Namespace], int]


def add(commands: Commands) -> None:
    """Declare the command and its measurements."""
    measure = commands.add_parser("measure", help="measure faults and marks of this service")
    kinds = measure.add_subparsers(title="measurements", required=True, metavar="WHAT")
    invariants = _kind(
        kinds,
        "invariants",
        _invariants,
        "what must hold beside random clients, kills and freezes",
    )
    number(invariants, "--minutes", 10.0, "M", "minutes of random clients")
    number(invariants, "--seed", 0, "N", "seed of the random requests")
    marks = _kind(kinds, "marks", _marks, "the figures that the project has marks for")
    marks.add_argument("--write", action="store_true", help="write the table into FIGURES.md")


def _kind(kinds: Commands, name: str, run: Run, text: str) -> argparse.ArgumentParser:
    kind: argparse.ArgumentParser = kinds.add_parser(name, help=text)
    kind.set_defaults(run=run)
    add_json(kind)
    return kind


def _invariants(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.reliability.invariants import run

    return run(minutes=options.minutes, seed=options.seed, as_json=options.json)


def _marks(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.marks import run

    return run(write=options.write, as_json=options.json)
