"""Pictures whose air temperature is known: a CSV with columns image and temperature_c.

`image` is a path relative to the CSV. A column `source` groups the rows; without one a picture
belongs to the folder it lies in.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.vlm.contract import Picture

COLUMNS = ("image", "temperature_c")
# degC, of the air near the ground, ever measured, rounded
COLDEST_C = -90.0
HOTTEST_C = 60.0
MOST_PIXELS = 64_000_000
MOST_BYTES = 64 * documents.MIB  # of a picture


class LabelledPictureError(HapticVLMError, ValueError):
    """A CSV or a picture of it cannot be used; the text names row and column."""


@dataclass(frozen=True, slots=True)
class LabelledPicture:
    """A picture, the air temperature where it was taken in degC, and where it comes from."""

    path: Path
    truth_c: float
    source: str


def read_pictures(file: Path) -> list[LabelledPicture]:
    """Read a CSV, all of it, before any picture is opened. Raises LabelledPictureError."""
    try:
        text = documents.read_bytes(file).decode("utf-8-sig")
        reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
        _check_header(file, reader.fieldnames or ())
        pictures = [_labelled(file, reader.line_num, row) for row in reader]
    except LabelledPictureError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        raise LabelledPictureError(f"{file}: {error}") from None
    if not pictures:
        raise LabelledPictureError(f"{file}: no rows")
    return pictures


def read_picture(labelled: LabelledPicture) -> Picture:
    """Decode a labelled picture to (H, W, 3) uint8 RGB, upright. Raises LabelledPictureError."""
    from PIL import Image, ImageOps

    try:
        with Image.open(io.BytesIO(documents.read_bytes(labelled.path, MOST_BYTES))) as picture:
            if picture.width * picture.height > MOST_PIXELS:
                raise LabelledPictureError(f"{labelled.path}: more than {MOST_PIXELS} pixels")
            return np.asarray(ImageOps.exif_transpose(picture).convert("RGB"))
    except LabelledPictureError:
        raise
    except (OSError, ValueError, Image.DecompressionBombError, SyntaxError) as error:
        raise LabelledPictureError(f"{labelled.path}: {error}") from None


def _check_header(file: Path, names: Sequence[str]) -> None:
    for column in COLUMNS:
        if column not in names:
            found = ", ".join(names) or "nothing"
            raise LabelledPictureError(f"{file}: row 1: no column `{column}`, found {found}")


def _labelled(file: Path, line: int, row: Mapping[str | None, str | None]) -> LabelledPicture:
    where = f"{file}: row {line}"
    image = (row["image"] or "").strip()
    stated = (row["temperature_c"] or "").strip()
    if not image:
        raise LabelledPictureError(f"{where}, column image: empty")
    path = file.parent / image
    if not path.is_file():
        raise LabelledPictureError(f"{where}, column image: no file `{image}` beside the CSV")
    source = (row.get("source") or "").strip() or Path(image).parent.name or file.stem
    return LabelledPicture(path, _temperature(f"{where}, column temperature_c", stated), source)


def _temperature(where: str, stated: str) -> float:
    try:
        value = float(stated)
    except ValueError:
        raise LabelledPictureError(f"{where}: `{stated}` is no number") from None
    if not math.isfinite(value) or not COLDEST_C <= value <= HOTTEST_C:
        raise LabelledPictureError(
            f"{where}: {stated} degC is not between {COLDEST_C:g} and {HOTTEST_C:g}"
        )
    return value
