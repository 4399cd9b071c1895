"""The parser of every command: suggests the nearest name for a wrong one, checks numbers."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import (
    TYPE_CHECKING,
    Any,
    NoReturn,
    TypeAlias,
)

if TYPE_CHECKING:
    Commands: TypeAlias = argparse._SubParsersAction[argparse.ArgumentParser]
else:
    Commands = argparse._SubParsersAction

_EXAMPLES = "examples:"
_CHOICE = re.compile(r"invalid choice: '(?P<word>[^']*)' \(choose from (?P<choices>.*)\)")
_OTHER_NAMES = {
    "run": "serve",
    "start": "serve",
    "calibration": "calibrate",
}


class _Formatter(argparse.HelpFormatter):
    """Wraps descriptions, and leaves examples unchanged."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        if text.startswith(_EXAMPLES):
            return text
        return super()._fill_text(text, width, indent)


class Parser(argparse.ArgumentParser):
    """Parses one command; its options carry `program`, the words that name the command."""

    def __init__(self, *args: Any, examples: Sequence[str] = (), **keywords: Any) -> None:
        if examples:
            keywords["epilog"] = "\n".join((_EXAMPLES, *(f"  {line}" for line in examples)))
        super().__init__(*args, **{"formatter_class": _Formatter, **keywords})
        self.set_defaults(program=self.prog)

    def parse_known_args(  # type: ignore[override]  # argparse's own has overloads for namespaces
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Refuse an unknown option in the name of this command, and suggest the nearest one."""
        parsed, unknown = super().parse_known_args(args, namespace)
        options = [word for word in unknown if word.startswith("-")]
        if options and self._subparsers is None:
            self.exit(2, f"{self.prog}: {self._no_such(options[0])}\n")
        return parsed, unknown

    def _no_such(self, option: str) -> str:
        name = option.partition("=")[0]
        flags = [flag for action in self._actions for flag in action.option_strings]
        near = get_close_matches(name, flags, 1)
        cure = f"did you mean {near[0]}?" if near else f"`{self.prog} --help` lists all options"
        return f"{name}: no such option; {cure}"

    def error(self, message: str) -> NoReturn:
        """Print the usage and a suggestion, and exit with 2."""
        super().error(suggest(message))


def suggest(message: str) -> str:
    """Add the nearest choice to argparse's message of an invalid one."""
    match = _CHOICE.search(message)
    if match is None:
        return message
    word = match["word"]
    choices = [choice.strip(" '") for choice in match["choices"].split(",")]
    near = [name for name in [_OTHER_NAMES.get(word, "")] if name in choices]
    near = near or get_close_matches(word, choices, n=1)
    return f"{message}; did you mean {near[0]}?" if near else message


def add_outline(parser: argparse.ArgumentParser) -> None:
    """Declare --no-outline, which leaves things on a plain ground as they are."""
    parser.add_argument(
        "--no-outline",
        dest="outline",
        action="store_false",
        help="do not outline a thing on a plain ground, such as a catalogue photograph's",
    )


def add_json(parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Declare --json, which means the same for every command."""
    summary = 'print JSON for programs, and no text for people; an error is {"error": TEXT}'
    parser.add_argument("--json", action="store_true", help=summary)


def number_within(low: float, high: float) -> Callable[[str], float]:
    """Return an argparse type for a number in a range."""

    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not within {low:g}..{high:g}")
        return value

    return number
