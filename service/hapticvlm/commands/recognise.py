"""`hapticvlm recognise`: what pictures show, by their pixels alone."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.recognition.frame_recogniser import FrameRecogniser
    from hapticvlm.recognition.ladder import Verdict

DIGITS = 4  # of a confidence in JSON
WIDEST = 60  # characters of a path, before the columns move

_DESCRIPTION = """
Say which material each picture shows: a line per picture, in the order given, as soon as it is
known. Only the pixels count, never the name of a file. Pictures are JPEG, PNG or WebP; a folder
stands for the pictures in it, in order of name, without the folders below it. Without a mask the
middle of a picture is looked at. Where the best guess is more likely wrong than right the material
is `unknown` and the guess stands as runner-up. Exit code 1: some picture could not be read; 2: no
picture was found, or an option is wrong.
"""


@dataclass(frozen=True, slots=True)
class Answer:
    """What one picture shows, or why it cannot be told."""

    path: Path
    verdict: Verdict | None = None
    error: str | None = None


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    recognise = commands.add_parser(
        "recognise", help="say which material pictures show", description=_DESCRIPTION
    )
    recognise.set_defaults(run=_recognise)
    recognise.add_argument(
        "paths", type=Path, nargs="+", metavar="PATH", help="pictures, or folders of them"
    )
    recognise.add_argument(
        "--mask",
        type=Path,
        metavar="FILE_OR_FOLDER",
        help="where the object is (nonzero), in the size of the upright picture: one mask for all "
        "pictures, or a folder with NAME.png for NAME.jpg; a picture without one is looked at in "
        "its middle",
    )
    recognise.add_argument("--json", action="store_true", help="print a JSON line per picture")
    recognise.add_argument("--encoder", metavar="NAME_OR_FOLDER", help="(the one shipped)")
    recognise.add_argument(
        "--gallery", type=Path, help="reference embeddings, or a gallery folder (those shipped)"
    )


def _recognise(options: argparse.Namespace) -> int:
    from hapticvlm.materials import MaterialError
    from hapticvlm.recognition.encoders.encoder import EncoderError
    from hapticvlm.recognition.galleries.gallery import GalleryError

    try:
        return _run(options)
    except BrokenPipeError:  # who reads has seen enough; nothing more may be flushed to it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (EncoderError, GalleryError, MaterialError) as error:
        _complain(" ".join(str(error).split()))
        return 2


def _run(options: argparse.Namespace) -> int:
    from hapticvlm.recognition.encoders.loading import load_encoder
    from hapticvlm.recognition.frame_recogniser import FrameRecogniser
    from hapticvlm.recognition.galleries.gallery import load_gallery

    if options.mask is not None and not options.mask.exists():
        _complain(f"--mask {options.mask}: no such file or folder")
        return 2
    found = _find(options.paths)
    if not any(path.is_file() for path in found):
        _complain("no picture found; name JPEG, PNG or WebP files, or folders of them")
        return 2
    encoder = load_encoder(options.encoder)
    recogniser = FrameRecogniser(encoder, load_gallery(options.gallery, encoder=encoder))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a file's name may be no text in any encoding
            stream.reconfigure(errors="backslashreplace")
    width = min(WIDEST, max(len(str(path)) for path in found))
    if not options.json:
        print(_row("picture", ("material", "confidence", "runner-up", "source"), width), flush=True)
    failed = False
    for answer in _answers(found, options.mask, recogniser):
        failed |= answer.error is not None
        _say(answer, None if options.json else width)
    return 1 if failed else 0


def _find(paths: Sequence[Path]) -> list[Path]:
    from hapticvlm.recognition.files import list_files

    found: list[Path] = []
    for path in paths:
        try:
            inside = list_files(path) if path.is_dir() else [path]
        except OSError as error:
            _complain(f"{path}: {error.strerror}")
            continue
        if not inside:
            _complain(f"{path}: no picture in it; folders below it are not searched")
        found += inside
    return found


def _answers(
    found: Sequence[Path], masks: Path | None, recogniser: FrameRecogniser
) -> Iterator[Answer]:
    """Recognise one picture after the other: none may sway another by being in a batch with it."""
    from hapticvlm.recognition.files import FileError, read_frame
    from hapticvlm.recognition.ladder import decide
    from hapticvlm.recognition.pictures import PictureError

    for path in found:
        try:
            frame = read_frame(path, _mask_of(path, masks))
            yield Answer(path, decide(recogniser.compare(frame, [None])))
        except FileError as error:
            yield Answer(path, error=str(error))
        except PictureError as error:
            yield Answer(path, error=f"{path}: {error}")


def _mask_of(path: Path, masks: Path | None) -> Path | None:
    if masks is None or not masks.is_dir():
        return masks
    mask = masks / f"{path.stem}.png"
    if mask.is_file():
        return mask
    _complain(f"{path}: no mask {mask}; its middle is looked at")
    return None


def _say(answer: Answer, width: int | None) -> None:
    """Print one answer, as JSON where there is no width."""
    verdict = answer.verdict
    if answer.error is not None:
        _complain(answer.error)
    if width is None:
        print(json.dumps(_fields(answer)), flush=True)
    elif verdict is not None:
        runner_up, confidence = verdict.runner_up or "-", f"{verdict.confidence:.2f}"
        cells = (verdict.material, confidence, runner_up, verdict.source)
        print(_row(str(answer.path), cells, width), flush=True)


def _fields(answer: Answer) -> dict[str, object]:
    verdict = answer.verdict
    if verdict is None:
        return {"path": str(answer.path), "error": answer.error}
    return {
        "path": str(answer.path),
        "material": verdict.material,
        "confidence": round(verdict.confidence, DIGITS),
        "runner_up": verdict.runner_up,
        "source": verdict.source,
    }


def _row(path: str, cells: tuple[str, str, str, str], width: int) -> str:
    material, confidence, runner_up, source = cells
    return f"{path:<{width}}  {material:<10} {confidence:>10}  {runner_up:<10} {source}"


def _complain(text: str) -> None:
    print(f"hapticvlm recognise: {text}", file=sys.stderr, flush=True)
