"""Options that several of the laboratory's commands declare alike."""

from __future__ import annotations

import argparse
from pathlib import Path


def number(
    parser: argparse.ArgumentParser, flag: str, default: float, metavar: str, text: str
) -> None:
    """Declare a number, whole where its default is; the help shows the default."""
    parser.add_argument(
        flag, type=type(default), default=default, metavar=metavar, help=f"{text} (%(default)s)"
    )


def only(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare --only, which measures some rows and leaves the others out."""
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar=what.upper(),
        help=f"measure this {what} only, repeatable (all)",
    )


def labelled_pictures(parser: argparse.ArgumentParser) -> None:
    """Declare --data, the folder of training/sources.py."""
    parser.add_argument(
        "--data",
        type=Path,
        metavar="FOLDER",
        help="labelled pictures (../shared/data if it exists)",
    )
