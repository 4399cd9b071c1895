"""Reads pictures with known air temperature from a CSV with the columns image and temperature_c.

`image` is a path relative to the CSV.
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
# Extremes of air temperature ever measured near the ground, rounded, degC.
COLDEST_C = -90.0
HOTTEST_C = 60.0
MAX_PIXELS = 64_000_000
MAX_BYTES = 64 * documents.MIB  # of a picture


class LabelledPictureError(HapticVLMError, ValueError):
    """Raised when a CSV or one of its pictures cannot be used; the message names row and column."""


@dataclass(frozen=True, slots=True)
class LabelledPicture:
    """A picture and the air temperature where it was taken, degC."""

    path: Path
    truth_c: float


def read_pictures(file: Path) -> list[LabelledPicture]:
    """Return the rows of a CSV; opens no picture. Raises LabelledPictureError."""
    try:
        content = documents.read_text(file)
        reader = csv.DictReader(io.StringIO(content, newline=""), strict=True)
        _check_header(file, reader.fieldnames or ())
        pictures = [_labelled(file, reader.line_num, row) for row in reader]
    except LabelledPictureError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        raise LabelledPictureError(f"{file}: {documents.reason(error)}") from None
    if not pictures:
        raise LabelledPictureError(f"{file}: no rows")
    return pictures


def read_picture(labelled: LabelledPicture) -> Picture:
    """Return a picture as (H, W, 3) uint8 RGB, upright. Raises LabelledPictureError."""
    from PIL import Image, ImageOps

    try:
        with Image.open(io.BytesIO(documents.read_bytes(labelled.path, MAX_BYTES))) as picture:
            if picture.width * picture.height > MAX_PIXELS:
                raise LabelledPictureError(f"{labelled.path}: more than {MAX_PIXELS} pixels")
            return np.asarray(ImageOps.exif_transpose(picture).convert("RGB"))
    except LabelledPictureError:
        raise
    except (OSError, ValueError, Image.DecompressionBombError, SyntaxError) as error:
        raise LabelledPictureError(f"{labelled.path}: {documents.reason(error)}") from None


def _check_header(file: Path, names: Sequence[str]) -> None:
    for column in COLUMNS:
        if column not in names:
            columns = ", ".join(names) or "nothing"
            raise LabelledPictureError(f"{file}: row 1: no column `{column}`, found {columns}")


def _labelled(file: Path, line: int, row: Mapping[str | None, str | None]) -> LabelledPicture:
    where = f"{file}: row {line}"
    image = (row["image"] or "").strip()
    stated = (row["temperature_c"] or "").strip()
    if not image:
        raise LabelledPictureError(f"{where}, column image: empty")
    path = file.parent / image
    if not path.is_file():
        raise LabelledPictureError(f"{where}, column image: no file `{image}` beside the CSV")
    return LabelledPicture(path, _temperature(f"{where}, column temperature_c", stated))


def _temperature(where: str, stated: str) -> float:
    try:
        value = float(stated)
    except ValueError:
        raise LabelledPictureError(f"{where}: `{stated}` is not a number") from None
    if not math.isfinite(value) or not COLDEST_C <= value <= HOTTEST_C:
        raise LabelledPictureError(
            f"{where}: {stated} degC is not between {COLDEST_C:g} and {HOTTEST_C:g} degC"
        )
    return value
