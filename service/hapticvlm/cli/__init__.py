"""The command line: the only place that wires parts together. Imports late, to start at once."""

from __future__ import annotations

import argparse
import logging
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hapticvlm import __version__
from hapticvlm.cli import (
    calibrate,
    charts,
    doctor,
    evaluate,
    feel,
    gallery,
    measure,
    plate,
    recognise,
    recording,
    scenes,
    serve,
    study,
)

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    options = _parser().parse_args(arguments)
    logging.basicConfig(
        level=options.log_level.upper(), format="%(asctime)s %(levelname)s %(name)s: %(message)s"
    )
    try:
        code: int = options.run(options)
    except KeyboardInterrupt:
        return 130
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hapticvlm",
        description="Makes objects in a VR scene feel like what they look like.",
    )
    parser.add_argument("--version", action="version", version=f"hapticvlm {__version__}")
    parser.add_argument(
        "--log-level", default="warning", choices=["debug", "info", "warning", "error"]
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for part in (
        serve,
        scenes,
        recording,
        recognise,
        feel,
        gallery,
        measure,
        evaluate,
        charts,
        calibrate,
        plate,
        study,
        doctor,
    ):
        part.add(commands)
    return parser
