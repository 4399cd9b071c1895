"""`hapticvlm gallery`: make, extend, show and test what pictures are compared with."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

ENCODER_HELP = "image encoder (the one shipped)"


def add(commands: Commands) -> None:
    """Declare the commands and their options."""
    gallery = commands.add_parser("gallery", help="reference pictures: build, add, list, test")
    kinds = gallery.add_subparsers(title="commands", required=True, metavar="WHAT")
    _add_build(kinds)
    _add_add(kinds)
    listing = kinds.add_parser("list", help="what a gallery holds")
    listing.set_defaults(run=_run, what="list")
    listing.add_argument("gallery", type=Path, nargs="?", help=".npz or folder (the one shipped)")
    test = kinds.add_parser("test", help="how often a gallery is right about labelled pictures")
    test.set_defaults(run=_run, what="test")
    test.add_argument("gallery", type=Path, help=".npz or gallery folder")
    test.add_argument("pictures", type=Path, help="folder with a folder for each material")
    test.add_argument("--encoder", help=ENCODER_HELP)
    test.add_argument("--json", action="store_true", help="print the JSON line only")


def _add_build(kinds: Commands) -> None:
    build = kinds.add_parser(
        "build",
        help="make a gallery from FOLDER/<material>/*.jpg|png",
        description="Masks, if any: FOLDER/<material>/masks/NAME.png or NAME.mask.png beside it.",
    )
    build.set_defaults(run=_run, what="build")
    build.add_argument("folder", type=Path, help="folder with a folder for each material")
    build.add_argument(
        "-o", "--out", type=Path, required=True, help="file (.npz) or gallery folder to write"
    )
    build.add_argument("--encoder", help=ENCODER_HELP)
    build.add_argument(
        "--base",
        choices=["shipped", "none"],
        default="none",
        help="keep the shipped references beside these (%(default)s)",
    )


def _add_add(kinds: Commands) -> None:
    own = kinds.add_parser("add", help="add a material of your own to a gallery folder")
    own.set_defaults(run=_run, what="add")
    own.add_argument("name", help="1 to 40 of a-z, 0-9, _ and -")
    own.add_argument("pictures", type=Path, nargs="+", help="pictures, or folders of them")
    own.add_argument("--like", required=True, metavar="CLASS", help="the class it resembles")
    own.add_argument(
        "--words",
        metavar="WORD,...",
        help="words for it in names of objects, with commas between them (its name)",
    )
    own.add_argument(
        "--set",
        dest="facts",
        action="append",
        default=[],
        metavar="FACT=VALUE",
        help="what differs from the class, e.g. thermal.conductivity=0.2 (repeatable)",
    )
    own.add_argument(
        "--into", type=Path, default=Path("gallery"), help="gallery folder (%(default)s)"
    )
    own.add_argument("--encoder", help=ENCODER_HELP)


def _run(options: argparse.Namespace) -> int:
    from hapticvlm.commands.gallery import build, test

    match options.what:
        case "build":
            return build.build(options)
        case "add":
            return build.add(options)
        case "list":
            return build.show(options.gallery)
        case _:
            path, pictures = options.gallery, options.pictures
            return test.run(path, pictures, options.encoder, as_json=options.json)
