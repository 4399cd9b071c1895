"""Text files that other people wrote: read whole, but only so much, and parsed without surprises.

A fifo would hang, a file of gigabytes fill the memory, a deep nesting end the parser; each is an
error that can be shown instead. Knows no field of any file.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

MIB = 1024 * 1024
MAX_BYTES = 16 * MIB
MAX_KEY_PARTS = 16  # of a dotted TOML key: thousands unfold to gigabytes
_TOO_DEEP = "nested too deep"


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read a regular file of at most `most` bytes. Raises OSError, ValueError."""
    if path.exists() and not path.is_file():
        raise OSError(0, "not a regular file", str(path))
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise ValueError(f"larger than {most} bytes")
    return data


def read_text(path: Path, most: int = MAX_BYTES) -> str:
    """Read a regular UTF-8 file. Raises OSError, ValueError (UnicodeDecodeError among them)."""
    return read_bytes(path, most).decode("utf-8")


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


def _is_list(key: str) -> bool:
    """Whether what begins with a bracket is a line of numbers and no table's name."""
    return "," in key or "=" in key
