"""The base of every error that a user can cause and mend, and the one line it becomes.

Its text names the thing, the limit and what to do. `commands/main.py` holds the only handler;
whatever else is raised is a defect of ours and shows its traceback.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

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


def line(error: BaseException) -> str:
    """Put an error on one line of bounded length; an OSError names its file."""
    text = str(error)
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename2 or error.filename}: {error.strerror}; {CURE}"
    return (" ".join(text.split()) or type(error).__name__)[:LONGEST]
