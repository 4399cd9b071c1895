"""Options that several commands of the laboratory share."""

from __future__ import annotations

import argparse
from pathlib import Path


def number(
    parser: argparse.ArgumentParser, flag: str, default: float, metavar: str, text: str
) -> None:
    """Declare a number of the type of its default; the help shows the default."""
    parser.add_argument(
        flag, type=type(default), default=default, metavar=metavar, help=f"{text} (%(default)s)"
    )


def labelled_pictures(parser: argparse.ArgumentParser) -> None:
    """Declare --data, the folder that training/sources.py describes."""
    parser.add_argument(
        "--data",
        type=Path,
        metavar="FOLDER",
        help="folder of labelled pictures (../shared/data if it exists)",
    )
