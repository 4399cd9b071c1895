"""Declares the base of every error that a user can cause and correct, and its one-line form.

The message names the thing, the limit and what to do. `commands/main.py` has the only handler; any
other exception is a bug of this program and shows its traceback.
"""

from __future__ import annotations

import errno
import importlib.util
import os
import re
import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MORE_MEMORY = "raise the limit (ulimit -v, MemoryMax, docker --memory) or end other programs"
NOT_MAPPED = ("failed to map segment", "cannot allocate memory")  # of a library, by the loader
FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
# What to do about an error of the file system.
CURES = {
    errno.ENOENT: "check the path; a folder in it may be missing",
    errno.EACCES: "choose a place that you may use",
    errno.EEXIST: "name another place",
    errno.EISDIR: "name a file",
    errno.EBUSY: "it may be mounted by itself: mount its folder instead",
    errno.EROFS: "choose a place that you may use",
    errno.EFBIG: "raise the limit (ulimit -f), or choose another place",
    errno.ENOTDIR: "name a folder",
    **dict.fromkeys(FULL, "free some space, or choose another place"),
}
REFUSED_ON_WINDOWS = (1225, 10061)  # a connection, by asyncio and by sockets
LONGEST = 600  # characters of the line; the message of a third-party library may have any length
SHORT = 160  # characters of a library's reason within a sentence of ours


class HapticVLMError(Exception):
    """An error that the user can correct; the message says how."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Go through queues and pools whatever the parameters of a subclass are."""
        return _restored, (type(self), self.args), self.__dict__


def _restored(kind: type[HapticVLMError], words: tuple[Any, ...]) -> HapticVLMError:
    return kind.__new__(kind, *words)


class UsageError(HapticVLMError):
    """An option, a file or a value is not valid."""


@contextmanager
def usage_errors() -> Iterator[None]:
    """Convert a ValueError into a UsageError, around code whose values came from the user."""
    try:
        yield
    except ValueError as error:
        if isinstance(error, HapticVLMError):
            raise
        raise UsageError(str(error)) from None


def why_no_folder(path: Path) -> str:
    """Return why this path is not a folder, as the beginning of an error."""
    return f"{path}: {'not a folder' if path.exists() else 'no such folder'}"


def network_reason(error: Exception) -> str:
    """Return in words why a service was not reached, without the numbers of the system."""
    text = str(error) or type(error).__name__
    refused = (str(number) for number in (errno.ECONNREFUSED, *REFUSED_ON_WINDOWS))
    if isinstance(error, ConnectionRefusedError) or any(f" {each}]" in text for each in refused):
        return "nothing listens there"
    return re.sub(r"\[(?:Errno|WinError) -?\d+\] ", "", text)


def shell_word(value: str | Path) -> str:
    """Return a value as one word of a shell, for a command that is printed to be copied."""
    if os.name != "nt":
        return shlex.quote(str(value))
    import subprocess

    return subprocess.list2cmdline([str(value)])


def installing(packages: str) -> str:
    """Return the command that installs packages into the environment of this program."""
    here = Path(sys.prefix)
    python = shell_word(sys.executable)
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
    """Return a third party's text as one line of at most `max_chars` that is safe to print.

    Names and answers of others may hold escape codes, which move a terminal's cursor or set its
    title, line breaks, which forge a line of a log, and marks that reverse the direction of
    writing. Each becomes a space; text that is too long is cut and ends with dots.
    """
    clean = "".join(c if c.isprintable() else " " for c in text[: 4 * max_chars])
    clean = " ".join(clean.split())
    return clean if len(clean) <= max_chars else clean[:max_chars] + "..."


def short_line(error: Exception) -> str:
    """Return a library's error as a printable reason of bounded length, to put into a sentence."""
    return printable(str(error), SHORT) or type(error).__name__


def out_of_memory(error: BaseException) -> str | None:
    """Return a sentence if this error means that no memory or thread was left, else None."""
    words = str(error)
    is_scarce = (
        isinstance(error, MemoryError)
        or (isinstance(error, RuntimeError) and "start new thread" in words)
        or (isinstance(error, ImportError) and any(sign in words for sign in NOT_MAPPED))
    )
    return f"no memory or no thread is left; {MORE_MEMORY}" if is_scarce else None


def one_line(error: BaseException) -> str:
    """Return an error as one printable line of bounded length; an OSError names its file."""
    text = str(error)
    if isinstance(error, OSError) and error.filename is not None:
        name = error.filename2 or error.filename
        if error.errno == errno.ENOTDIR:  # what the user named, not a file that we look for in it
            name = next((each for each in reversed(Path(name).parents) if each.is_file()), name)
        text = f"{name}: {error.strerror}{_cure(error)}"
    elif isinstance(error, OSError) and error.strerror:  # of a write, which knows no name
        text = f"{error.strerror}{_cure(error)}"
    return printable(text) or type(error).__name__


def _cure(error: OSError) -> str:
    cure = CURES.get(error.errno or 0)
    return f"; {cure}" if cure else ""
