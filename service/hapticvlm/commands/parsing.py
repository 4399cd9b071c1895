"""What every command needs to declare itself: a parser that suggests, and kinds of numbers."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
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
_CHOICE = re.compile(r"invalid choice: '(?P<given>[^']*)' \(choose from (?P<choices>.*)\)")
_OTHER_NAMES = {
    "run": "serve",
    "start": "serve",
    "calibration": "calibrate",
}


class _Formatter(argparse.HelpFormatter):
    """Wraps descriptions, and leaves examples as they are written."""

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
        """Refuse what this command does not know, by its own name and with the nearest option."""
        found, unknown = super().parse_known_args(args, namespace)
        options = [text for text in unknown if text.startswith("-")]
        if options and self._subparsers is None:
            self.exit(2, f"{self.prog}: {self._no_such(options[0])}\n")
        return found, unknown

    def _no_such(self, option: str) -> str:
        name = option.partition("=")[0]
        shown = [action for action in self._actions if action.help != argparse.SUPPRESS]
        near = get_close_matches(name, [flag for each in shown for flag in each.option_strings], 1)
        cure = f"did you mean {near[0]}?" if near else f"`{self.prog} --help` lists them"
        return f"{name}: no such option; {cure}"

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


def add_json(parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Declare --json, which means the same for every command."""
    text = 'print JSON for programs, and no text for people; an error is {"error": TEXT}'
    parser.add_argument("--json", action="store_true", help=text)


def add_former(
    parser: argparse.ArgumentParser | argparse._ArgumentGroup, flag: str, dest: str
) -> None:
    """Accept an older name of the path option `dest`, without showing it."""
    parser.add_argument(
        flag, dest=dest, type=Path, default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )


def number_within(low: float, high: float) -> Callable[[str], float]:
    """Make an argparse type for a number in a range."""

    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not within {low:g}..{high:g}")
        return value

    return number
