"""Tells messages for people from those of Python itself."""

import re

# Classes and members as Python prints them, and the words of its own exceptions.
OF_PYTHON = re.compile(
    r"\[Errno|\b\w+Error\(|<[A-Z]\w*\.\w+: |<\w+(\.\w+)* object at |\bNoneType\b"
    r"|'(str|int|float|list|dict|bool|tuple|bytes)'|has no attribute|unsupported operand"
    r"|not supported between|not subscriptable|not iterable|unhashable|positional argument"
    r"|keyword argument|object is not|codec can't|is not a valid [A-Z]|could not convert"
    r"|invalid literal|values to unpack|unpack non-|indices must be|argument must be"
    r"|cannot convert float"
)


class NotPlainError(Exception):
    """A message to people in words of Python."""


def require_plain(message: str) -> None:
    """Raise NotPlainError for a message in words of Python."""
    if not is_plain(message):
        raise NotPlainError(message)


def is_plain(message: str) -> bool:
    """Return whether a message says nothing in words of Python."""
    return not OF_PYTHON.search(message)
