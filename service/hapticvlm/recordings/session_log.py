"""Reads a recorded session: the lines of its log, and blanks for pictures that were not kept."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.messages import MAX_SIDE_PX
from hapticvlm.recordings.lines import VERSION, Key, Line
from hapticvlm.recordings.recorder import SESSION_LOG

MAX_PICTURE_BYTES = MAX_SIDE_PX * MAX_SIDE_PX * 4  # the largest there is: rgba8


class SessionLogError(HapticVLMError):
    """Raised when a session cannot be read or replayed; names the file, the line and the cause."""


# What a line with fields that are missing, or of another kind, raises where it is used.
DAMAGED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def not_a_line(place: str, error: Exception) -> SessionLogError:
    """Return the error for a line that cannot be used; `place` names file and line."""
    return SessionLogError(f"{place}: not a line of a session log ({documents.reason(error)})")


def newest_session(folder: Path) -> Path:
    """Return the folder of a session: this one, or the newest below it.

    `serve --record` writes FOLDER/TIME and `demo` FOLDER/session/TIME; both print FOLDER.
    """
    if (folder / SESSION_LOG).exists():
        return folder
    below = [*folder.glob(f"*/{SESSION_LOG}"), *folder.glob(f"session/*/{SESSION_LOG}")]
    return max(below).parent if below else folder


def read_session_log(folder: Path) -> Iterator[Line]:
    """Yield the lines of a session's log, the head first. Raises SessionLogError."""
    path = folder / SESSION_LOG
    try:
        file = documents.open_file(path)
    except OSError as error:
        missing = path if folder.is_dir() else folder
        raise SessionLogError(
            f"{missing}: {error.strerror}; give a folder that `hapticvlm serve --record` wrote"
        ) from None
    with file:
        for number, data in enumerate(file, 1):
            place = f"{path}:{number}"
            line = _parsed(data, place)
            if number == 1:
                _check_version(line, place)
            yield line


def _parsed(data: bytes, place: str) -> Line:
    try:
        line = documents.parse_json(data)
    except ValueError:
        raise SessionLogError(f"{place}: incomplete, or not JSON") from None
    if not isinstance(line, dict):
        raise SessionLogError(f"{place}: not a line of a session log")
    return line


def _check_version(first: Line, place: str) -> None:
    """Refuse a log whose first line states another format version. Raises SessionLogError."""
    head = first.get(Key.HEAD)
    if not isinstance(head, dict):
        return  # the caller reports a missing head
    version = head.get(Key.VERSION)
    if version != VERSION:
        raise SessionLogError(
            f"{place}: format version {version!r}; this program reads {VERSION}: update hapticvlm"
        )


def kept_picture(folder: Path, name: str) -> Path:
    """Return the file of a picture that a line names. Raises SessionLogError.

    A session from somebody else may name any file: one outside its folder, a device that never
    ends, a pipe without a writer. Only a regular file within the folder is accepted.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise SessionLogError(f"{folder}: names a picture outside this folder ({name!r:.80})")
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
    """Return an empty picture of this format and size, in place of one that was not kept."""
    from PIL import Image

    if kind not in ("jpeg", "png"):
        return bytes(width * height * (3 if kind == "rgb8" else 4))
    buffer = io.BytesIO()
    Image.new("L" if kind == "png" else "RGB", (width, height)).save(buffer, kind.upper())
    return buffer.getvalue()
