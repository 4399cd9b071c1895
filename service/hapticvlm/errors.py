"""The base of every error that a user can cause and mend, and the one line it becomes.

Its text names the thing, the limit and what to do. `commands/main.py` holds the only handler;
whatever else is raised is a defect of ours and shows its traceback.
"""

from __future__ import annotations

import importlib.util
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

CURE = "free the place or name another"  # of whatever a file system refuses
LONGEST = 600  # characters of the line; a foreign library's text may be of any length


class HapticVLMError(Exception):
    """Something the user can mend; the text says what."""


class UsageError(HapticVLMError):
    """An option, a file or a value that does not fit."""


@contextmanager
def usage_errors() -> Iterator[None]:
    """Make a ValueError of a pure function one of usage, where its values came from the user."""
    try:
        yield
    except ValueError as error:
        if isinstance(error, HapticVLMError):
            raise
        raise UsageError(str(error)) from None


def installing(packages: str) -> str:
    """Return the command that installs packages where this program runs from."""
    here = Path(sys.prefix)
    python = sys.executable
    python = f'"{python}"' if " " in python else python
    if (here / "uv-receipt.toml").is_file():  # `uv tool install`, which brings no pip
        return f"uv pip install --python {python} {packages}"
    if (here / "pipx_metadata.json").is_file():
        return f"pipx inject hapticvlm {packages}"
    pip = shutil.which("pip")
    if pip is not None and Path(pip).parent == Path(sys.executable).parent:
        return f"pip install {packages}"
    if importlib.util.find_spec("pip") is None:
        return f"pip --python {python} install {packages}"
    return f"{python} -m pip install {packages}"


def printable(text: str, max_chars: int = LONGEST) -> str:
    """Put foreign words on one line of bounded length that no terminal obeys.

    Names and answers of others may hold escape codes, which move a terminal's cursor or set its
    title, line breaks, which forge a line of a log, and marks that turn the direction of writing.
    Each becomes a space; what is too long ends with dots.
    """
    clean = "".join(c if c.isprintable() else " " for c in text[: 4 * max_chars])
    clean = " ".join(clean.split())
    return clean if len(clean) <= max_chars else clean[:max_chars] + "..."


def one_line(error: BaseException) -> str:
    """Put an error on one printable line of bounded length; an OSError names its file."""
    text = str(error)
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename2 or error.filename}: {error.strerror}; {CURE}"
    return printable(text) or type(error).__name__
