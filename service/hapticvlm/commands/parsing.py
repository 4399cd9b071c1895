"""What every command needs to declare itself: a parser that suggests, and knows its own name."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

if TYPE_CHECKING:
    Commands: TypeAlias = argparse._SubParsersAction[argparse.ArgumentParser]
else:
    Commands = argparse._SubParsersAction

_CHOICE = re.compile(r"invalid choice: '(?P<given>[^']*)' \(choose from (?P<choices>.*)\)")
_OTHER_NAMES = {
    "recognize": "recognise",
    "run": "serve",
    "start": "serve",
    "calibration": "calibrate",
}


class Parser(argparse.ArgumentParser):
    """Parses one command; its options carry `program`, the words that name the command."""

    def __init__(self, *args: Any, **keywords: Any) -> None:
        super().__init__(*args, **keywords)
        self.set_defaults(program=self.prog)

    def error(self, message: str) -> NoReturn:
        """Print the usage and what was probably meant, and leave with 2."""
        super().error(suggest(message))


def suggest(message: str) -> str:
    """Add the nearest choice to argparse's message of an invalid one."""
    found = _CHOICE.search(message)
    if found is None:
        return message
    given = found["given"]
    choices = [choice.strip(" '") for choice in found["choices"].split(",")]
    near = [name for name in [_OTHER_NAMES.get(given, "")] if name in choices]
    near = near or get_close_matches(given, choices, n=1)
    return f"{message}; did you mean {near[0]}?" if near else message


def number_within(low: float, high: float) -> Callable[[str], float]:
    """Make an argparse type for a number in a range."""

    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not within {low:g}..{high:g}")
        return value

    return number
