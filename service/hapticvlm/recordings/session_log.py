"""Reads a recorded session: the lines of its log, and blanks for pictures that were not kept."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.messages import MAX_SIDE_PX
from hapticvlm.recordings.lines import Line
from hapticvlm.recordings.recorder import SESSION_LOG

MAX_PICTURE_BYTES = MAX_SIDE_PX * MAX_SIDE_PX * 4  # the largest there is: rgba8


class SessionLogError(HapticVLMError):
    """A record that cannot be run again: which file, which line, why."""


def read_session_log(folder: Path) -> Iterator[Line]:
    """Yield the lines of a record, the head first. Raises SessionLogError."""
    path = folder / SESSION_LOG
    try:
        file = documents.open_file(path)
    except OSError as error:
        raise SessionLogError(
            f"{path}: {error.strerror}; name a folder that `record` made"
        ) from None
    with file:
        for number, text in enumerate(file, 1):
            try:
                line = documents.parse_json(text)
            except ValueError:
                raise SessionLogError(f"{path}:{number}: incomplete, or no JSON") from None
            if not isinstance(line, dict):
                raise SessionLogError(f"{path}:{number}: not a line of a session log")
            yield line


def kept_picture(folder: Path, name: str) -> Path:
    """Return the file of a picture that a line names. Raises SessionLogError.

    A session that somebody else gave may name any file: one outside its folder, a device that never
    ends, a pipe that nobody writes to. Only a regular file within the folder is a picture of it.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise SessionLogError(f"{folder}: names a picture outside this folder")
    if path.exists() and not path.is_file():
        raise SessionLogError(f"{folder}: {name!r} is not a regular file")
    return path


def read_picture(folder: Path, name: str) -> bytes:
    """Read a picture that a line names, of a bounded size. Raises SessionLogError."""
    path = kept_picture(folder, name)
    try:
        return documents.read_bytes(path, MAX_PICTURE_BYTES)
    except (OSError, ValueError) as error:
        raise SessionLogError(f"{path}: {documents.reason(error)}") from None


def blank_picture(kind: str, width: int, height: int) -> bytes:
    """Make a picture of nothing, which passes for one of that format and size."""
    from PIL import Image

    if kind in ("rgb8", "rgba8"):
        return bytes(width * height * (3 if kind == "rgb8" else 4))
    buffer = io.BytesIO()
    Image.new("L" if kind == "png" else "RGB", (width, height)).save(buffer, kind.upper())
    return buffer.getvalue()
