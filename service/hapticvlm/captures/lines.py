"""Reads and writes the lines of a capture.

A line of capture.jsonl is one protocol message without its id, plus `t_s` (the time it was sent),
`file` and `mask_file` (its pictures) and `truth` (the material touched or shown, for evaluation
only).
"""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import msgspec

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError

LINES = "capture.jsonl"
MAX_BYTES = 256 * documents.MIB  # an hour of touches and frames


class _Extras(msgspec.Struct, frozen=True):
    """The fields of a line that are not of its protocol message, and the message's type."""

    t_s: float
    type: str
    file: str | None = None
    mask_file: str | None = None
    truth: str | None = None


_NAMES = frozenset(_Extras.__struct_fields__)


class CaptureError(HapticVLMError):
    """Raised when a capture cannot be read; names the file, the line and what to do."""


@dataclass(frozen=True, slots=True)
class Line:
    """One message of a capture; `fields` are those of the protocol, without type and id."""

    t_s: float
    type: str
    fields: dict[str, Any]
    file: Path | None = None
    mask_file: Path | None = None
    truth: str | None = None
    image: bytes | None = None

    def message(self) -> dict[str, Any]:
        """Return the fields of the protocol message, with pictures read from their files.

        A frame may have a mask or a region, not both: the mask is used where there is one. Raises
        CaptureError.
        """
        fields = dict(self.fields)
        image = self.image if self.file is None else _picture(self.file)
        if image is not None:
            fields["image"] = image
        if self.mask_file is not None:
            fields["mask"] = _picture(self.mask_file)
            fields.pop("region", None)
        return fields


def _picture(path: Path) -> bytes:
    try:
        return documents.read_bytes(path)
    except (OSError, ValueError) as error:
        raise CaptureError(
            f"{path}: {documents.reason(error)}; a line of the capture names it as a picture"
        ) from None


class Recorder:
    """Writes lines of a capture or of decisions to a file, one JSON object each."""

    def __init__(self, path: Path) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8")

    def write(self, t_s: float, message: dict[str, Any], **extras: Any) -> None:
        """Append one message; replace its pictures by `file` first."""
        line = {"t_s": round(t_s, 6), **message, **extras}
        self._file.write(json.dumps(line) + "\n")

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def read_lines(path: Path) -> tuple[Line, ...]:
    """Read a file of lines, in time order. Raises CaptureError."""
    try:
        content = documents.read_text(path, MAX_BYTES)
    except (OSError, ValueError) as error:
        raise CaptureError(f"{path}: {documents.reason(error)}") from None
    lines: list[Line] = []
    for number, row in enumerate(content.splitlines(), 1):
        if row.strip():
            lines.append(_line(row, path, number))
    for number, (before, after) in enumerate(itertools.pairwise(lines), 2):
        if after.t_s < before.t_s:
            raise CaptureError(f"{path}:{number}: t_s goes back; sort the lines by time")
    return tuple(lines)


def _line(row: str, path: Path, number: int) -> Line:
    try:
        entry = documents.parse_json(row)
        extras = msgspec.convert(entry, _Extras)
        if not math.isfinite(extras.t_s):
            raise ValueError("t_s must be a finite number of seconds")
        return Line(
            t_s=extras.t_s,
            type=extras.type,
            fields={name: value for name, value in entry.items() if name not in _NAMES},
            file=_beside(path, extras.file),
            mask_file=_beside(path, extras.mask_file),
            truth=extras.truth,
        )
    except (OSError, ValueError) as error:
        reason = documents.reason(error)
        raise CaptureError(f"{path}:{number}: not a capture line ({reason})") from None


def _beside(path: Path, name: str | None) -> Path | None:
    """Resolve a picture's name, which must stay inside the capture's folder."""
    if name is None:
        return None
    picture = (path.parent / name).resolve()
    if not picture.is_relative_to(path.parent.resolve()):
        raise ValueError(f"{name} is outside the capture's folder")
    if picture.exists() and not picture.is_file():
        raise ValueError(f"{name} is not a regular file")
    return picture
