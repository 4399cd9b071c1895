"""`hapticvlm recognise` prints the material that pictures show, by their pixels alone."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_encoder, add_json, add_outline, number_within
from hapticvlm.errors import UsageError

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.messages import Region
    from hapticvlm.vision.picture_recogniser import PictureRecogniser, RecognisedPicture

DIGITS = 4  # of a confidence in JSON
GIVE = "give JPEG, PNG or WebP files, or folders of them"
WIDEST = 60  # characters of a path, before the columns move

_DESCRIPTION = """
Print the material that each picture shows, one line for each. Only the pixels are used, never the
name of a file. Pictures are JPEG, PNG or WebP. A folder stands for the pictures in it, but not in
its sub-folders. Without a mask the whole picture is recognised: crop it to the object. A thing on a
plain ground is outlined and recognised by itself, too; the mean of both counts. Unless
the best guess is probably right, the material is `unknown` and the guess is the runner-up.
With --texture the pictures are the base-colour maps of surfaces, read as the service reads those
that a scene sends. Exit code 1: a picture could not be read; 2: no picture was found, or an option
is wrong.
"""


@dataclass(frozen=True, slots=True)
class Answer:
    """The recognition of one picture, or the error that prevented it."""

    path: Path
    result: RecognisedPicture | None = None
    error: str | None = None


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    recognise = commands.add_parser(
        "recognise",
        help="print the material that pictures show",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm recognise photo.jpg frames/",
            "hapticvlm recognise --texture planks_basecolor.png --metallic 0",
            "hapticvlm recognise --texture atlas.png --region 0,0.5,0.25,0.25",
        ),
    )
    recognise.set_defaults(run=_recognise)
    recognise.add_argument(
        "paths", type=Path, nargs="+", metavar="PATH", help="pictures, or folders of them"
    )
    recognise.add_argument(
        "--mask",
        type=Path,
        metavar="FILE_OR_FOLDER",
        help="mask of the same size, nonzero where the object is: one file for all pictures, or "
        "a folder with NAME.png for NAME.jpg",
    )
    add_outline(recognise)
    recognise.add_argument(
        "--texture", action="store_true", help="the pictures are texture maps of surfaces"
    )
    recognise.add_argument(
        "--region",
        type=_region,
        metavar="X,Y,W,H",
        help="the part of each map that the surface uses, in fractions from the top left (all of "
        "it); needs --texture",
    )
    for name, meaning in (("metallic", "1 is a metal"), ("roughness", "0 is a mirror")):
        recognise.add_argument(
            f"--{name}",
            type=number_within(0.0, 1.0),
            metavar="0..1",
            help=f"{name} of the surface, or the mean of its map: {meaning}; needs --texture",
        )
    add_json(recognise)
    add_encoder(recognise)
    recognise.add_argument(
        "--gallery",
        type=Path,
        metavar="GALLERY",
        help=".npz file or gallery folder of reference pictures (the shipped one)",
    )


def _recognise(options: argparse.Namespace) -> int:
    from hapticvlm.vision.picture_recogniser import PictureRecogniser

    if options.mask is not None and not options.mask.exists():
        raise UsageError(f"--mask {options.mask}: no such file or folder")
    _check_texture(options)
    paths = _find(options.paths)
    if not any(path.is_file() for path in paths):
        raise UsageError(f"{paths[0]}: no such file; {GIVE}")
    recogniser = PictureRecogniser.load(options.encoder, options.gallery)
    width = min(WIDEST, max(len(str(path)) for path in paths))
    if not options.json:
        print(_row("picture", ("material", "confidence", "runner-up", "source"), width), flush=True)
    failed = False
    for answer in _answers(paths, options, recogniser):
        failed |= answer.error is not None
        _print(answer, None if options.json else width)
    return 1 if failed else 0


def _check_texture(options: argparse.Namespace) -> None:
    """Refuse options of textures without --texture, and those of other pictures with it."""
    if options.texture:
        if options.mask is not None or not options.outline:
            raise UsageError("--texture: a map has no outline; leave --mask and --no-outline out")
        return
    for name in ("region", "metallic", "roughness"):
        if getattr(options, name) is not None:
            raise UsageError(f"--{name}: only for texture maps; add --texture")


def _region(text: str) -> Region:
    """Read four fractions separated by commas. Raises ArgumentTypeError."""
    from hapticvlm.messages import Region

    try:
        x, y, w, h = (float(part) for part in text.split(","))
    except ValueError:
        problem = f"{text}: four fractions X,Y,W,H are needed, e.g. 0,0.5,0.25,0.25"
        raise argparse.ArgumentTypeError(problem) from None
    if not (0.0 <= x < 1.0 and 0.0 <= y < 1.0 and 0.0 < w <= 1.0 - x and 0.0 < h <= 1.0 - y):
        raise argparse.ArgumentTypeError(f"{text}: must lie within the map, 0..1")
    return Region(x=x, y=y, w=w, h=h)


def _find(paths: Sequence[Path]) -> list[Path]:
    from hapticvlm.vision.files import left_out, list_files

    pictures: list[Path] = []
    problems: list[str] = []
    for path in paths:
        try:
            inside = list_files(path) if path.is_dir() else [path]
            others = left_out(path) if path.is_dir() else None
        except OSError as error:
            problems.append(f"{path}: {error.strerror}")
            continue
        if others is not None:
            problems.append(f"{path}: left out: {others}; save them as JPEG, PNG or WebP")
        elif not inside:
            problems.append(f"{path}: contains no picture; sub-folders are not searched")
        pictures += inside
    if not pictures:
        raise UsageError(f"{'; '.join(problems)}; {GIVE}")
    for problem in problems:
        _complain(problem)
    return pictures


def _answers(
    paths: Sequence[Path], options: argparse.Namespace, recogniser: PictureRecogniser
) -> Iterator[Answer]:
    """Recognise one picture after the other: in a batch, one could change the result of another."""
    from hapticvlm.vision.files import FileError
    from hapticvlm.vision.pictures import PictureError

    for path in paths:
        try:
            if options.texture:
                shader = {"metallic": options.metallic, "roughness": options.roughness}
                yield Answer(path, recogniser.recognise_texture(path, options.region, **shader))
                continue
            mask = _mask_of(path, options.mask)
            yield Answer(path, recogniser.recognise(path, mask, outline=options.outline))
        except FileError as error:
            yield Answer(path, error=str(error))
        except PictureError as error:
            yield Answer(path, error=f"{path}: {error.text}")


def _mask_of(path: Path, masks: Path | None) -> Path | None:
    if masks is None or not masks.is_dir():
        return masks
    mask = masks / f"{path.stem}.png"
    if mask.is_file():
        return mask
    _complain(f"{path}: no mask {mask}; the whole picture is recognised")
    return None


def _print(answer: Answer, width: int | None) -> None:
    """Print one answer, as JSON where there is no width."""
    result = answer.result
    if answer.error is not None:
        _complain(answer.error)
    if width is None:
        print(json.dumps(_fields(answer)), flush=True)
    elif result is not None:
        source = f"{result.source}, outlined" if result.is_outlined else result.source
        cells = (result.material, f"{result.confidence:.2f}", result.runner_up or "-", source)
        print(_row(str(answer.path), cells, width), flush=True)


def _fields(answer: Answer) -> dict[str, object]:
    result = answer.result
    if result is None:
        return {"path": str(answer.path), "error": answer.error}
    return {
        "path": str(answer.path),
        "material": result.material,
        "confidence": round(result.confidence, DIGITS),
        "runner_up": result.runner_up,
        "source": result.source,
        "outlined": result.is_outlined,
        "beliefs": {name: round(belief, DIGITS) for name, belief in result.beliefs.items()},
    }


def _row(path: str, cells: tuple[str, str, str, str], width: int) -> str:
    material, confidence, runner_up, source = cells
    return f"{path:<{width}}  {material:<10} {confidence:>10}  {runner_up:<10} {source}"


def _complain(text: str) -> None:
    print(f"hapticvlm recognise: {text}", file=sys.stderr, flush=True)
