"""`hapticvlm gallery` makes, extends and prints the reference pictures of recognition."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_encoder, add_json, add_outline

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the commands and their options."""
    gallery = commands.add_parser(
        "gallery",
        help="build, extend or list reference pictures",
        description="A gallery holds the reference pictures that frames are compared with.",
        examples=(
            "hapticvlm gallery build pictures/ --out mygallery",
            "hapticvlm gallery add walnut walnut/ --like wood --out mygallery",
            "hapticvlm serve --gallery mygallery",
        ),
    )
    kinds = gallery.add_subparsers(title="commands", required=True, metavar="WHAT")
    _add_build(kinds)
    _add_add(kinds)
    _add_list(kinds)


def _add_build(kinds: Commands) -> None:
    build = kinds.add_parser(
        "build",
        help="make a gallery from pictures",
        description="Make a gallery from the pictures FOLDER/MATERIAL/* (JPEG, PNG or WebP). One "
        "to five pictures of each material are enough to begin. A mask is "
        "FOLDER/MATERIAL/masks/NAME.png, or NAME.mask.png beside the picture.",
        examples=("hapticvlm gallery build pictures/ --out mygallery",),
    )
    build.set_defaults(run=_run, what="build")
    build.add_argument(
        "folder", type=Path, metavar="FOLDER", help="folder with a sub-folder for each material"
    )
    build.add_argument(
        "-o", "--out", type=Path, required=True, metavar="GALLERY", help=".npz file or folder"
    )
    add_encoder(build)
    build.add_argument(
        "--base",
        choices=["shipped", "none"],
        default="none",
        help="references to keep: `shipped` adds yours to the shipped ones (%(default)s)",
    )
    add_outline(build)


def _add_add(kinds: Commands) -> None:
    adding = kinds.add_parser(
        "add",
        help="add a material of your own to a gallery folder",
        description="Add a material of your own. It has the properties of a material of the table "
        "except those you set. It can then be stated, named and recognised like any other.",
        examples=(
            "hapticvlm gallery add burl walnut/ --like wood --out mygallery \\",
            "    --set thermal.conductivity=0.2 --words walnut,burl",
        ),
    )
    adding.set_defaults(run=_run, what="add")
    adding.add_argument(
        "name", metavar="NAME", help="name of the material: 1 to 40 of a-z, 0-9, _ and -"
    )
    adding.add_argument(
        "pictures", type=Path, nargs="+", metavar="PATH", help="pictures, or folders of them"
    )
    adding.add_argument(
        "--like", required=True, metavar="MATERIAL", help="material of the table that it resembles"
    )
    adding.add_argument(
        "--words",
        metavar="WORD,...",
        help="words that name it in a scene, separated by commas (its name)",
    )
    adding.add_argument(
        "--set",
        dest="facts",
        action="append",
        default=[],
        metavar="FACT=VALUE",
        help="property that differs, such as thermal.conductivity=0.2 (repeatable)",
    )
    adding.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="GALLERY",
        default=Path("gallery"),
        help="gallery folder (%(default)s)",
    )
    add_outline(adding)
    add_encoder(adding)


def _add_list(kinds: Commands) -> None:
    listing = kinds.add_parser(
        "list",
        help="print the contents of a gallery, and how often it is right",
        description="Print the contents of a gallery. With FOLDER also recognise its labelled "
        "pictures, and print for each material how often the gallery is right. Use pictures that "
        "are not in the gallery.",
        examples=("hapticvlm gallery list", "hapticvlm gallery list mygallery other-pictures/"),
    )
    listing.set_defaults(run=_run, what="list")
    listing.add_argument(
        "gallery",
        type=Path,
        nargs="?",
        metavar="GALLERY",
        help=".npz file or gallery folder (the shipped one)",
    )
    listing.add_argument(
        "pictures",
        type=Path,
        nargs="?",
        metavar="FOLDER",
        help="folder of pictures to recognise, with a sub-folder for each material",
    )
    add_encoder(listing)
    add_outline(listing)
    add_json(listing)


def _run(options: argparse.Namespace) -> int:
    from hapticvlm.commands.gallery import build, contents

    match options.what:
        case "build":
            return build.build(options)
        case "add":
            return build.add(options)
        case _:
            return contents.run(options)
