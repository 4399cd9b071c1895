"""Files that other people give: read whole, but only so much, and parsed without surprises.

A fifo would hang, a device never end, a file of gigabytes fill the memory, a slow disk hold up who
reads, a deep nesting end the parser; each is an error that can be shown instead. Every file that a
user or a stranger names is opened here. Knows no field of any file.
"""

from __future__ import annotations

import errno
import json
import os
import stat
import time
import tomllib
from io import BufferedReader
from pathlib import Path
from typing import Any

MIB = 1024 * 1024
MAX_BYTES = 16 * MIB
READ_TIMEOUT_S = 10.0
PIECE_BYTES = 4 * MIB
MAX_KEY_PARTS = 16  # of a dotted TOML key: thousands unfold to gigabytes
_TOO_DEEP = "nested too deep"


def open_file(path: Path) -> BufferedReader:
    """Open a regular file to read, without waiting for whoever should write it. Raises OSError."""
    if path.is_dir():  # where a folder can't be opened, that would be called a lack of permission
        raise OSError(errno.EISDIR, "a folder, and not a file", str(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    try:
        # Asked of what was opened: between a look at the name and its opening it may be swapped.
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_bytes(path: Path, max_bytes: int = MAX_BYTES, timeout_s: float = READ_TIMEOUT_S) -> bytes:
    """Read a regular file of at most `max_bytes` bytes. Raises OSError, ValueError."""
    begun = time.monotonic()
    data = bytearray()
    with open_file(path) as file:
        while piece := file.read(min(PIECE_BYTES, max_bytes + 1 - len(data))):
            data += piece
            if len(data) > max_bytes:
                raise ValueError(
                    f"larger than {_size(max_bytes)}, the most there may be; shorten it"
                )
            if time.monotonic() - begun > timeout_s:
                text = f"not read within {timeout_s:g} s: {_size(len(data))} came"
                raise OSError(errno.ETIMEDOUT, f"{text}; copy it to a local disk", str(path))
    return bytes(data)


def read_text(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Read a regular UTF-8 file. Raises OSError, ValueError (UnicodeDecodeError among them)."""
    return read_bytes(path, max_bytes).decode("utf-8")


def reason(error: OSError | ValueError) -> str:
    """Return why a file could not be read, in a few words that do not name it."""
    return getattr(error, "strerror", None) or str(error)


def parse_toml(text: str) -> dict[str, Any]:
    """Parse TOML. Raises TOMLDecodeError, also for what is nested too deep."""
    for number, line in enumerate(text.splitlines(), 1):
        key = line if line.lstrip().startswith("[") else line.partition("=")[0]
        if len(key) > MAX_KEY_PARTS and key.count(".") >= MAX_KEY_PARTS and not _is_list(key):
            raise tomllib.TOMLDecodeError(f"line {number}: a key of too many parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError(_TOO_DEEP) from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:  # an integer of thousands of digits
        raise tomllib.TOMLDecodeError(str(error)) from None


def parse_json(text: str | bytes) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """Parse JSON. Raises ValueError, also for what is nested too deep."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None


def _size(count: int) -> str:
    """Return a size for a person: 16 MiB, 65536 bytes."""
    return f"{count // MIB} MiB" if count >= MIB and count % MIB == 0 else f"{count} bytes"


def _is_list(key: str) -> bool:
    """Whether what begins with a bracket is a line of numbers and no table's name."""
    return "," in key or "=" in key
