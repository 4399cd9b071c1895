"""The parser of every command: one line for each wrong use, with the nearest name, if any."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from itertools import pairwise, takewhile
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
SIMILARITY = 0.7  # of a word and a suggestion, 0..1 (difflib): "token" is none for "no-open"
# What argparse says.
_ARGUMENT = re.compile(r"^argument (?P<name>[^:]*): ")
_CHOICE = re.compile(
    r"^(?P<name>[^:]*): invalid choice: '(?P<word>[^']*)' \(choose from (?P<choices>.*)\)"
)
_VALUE = re.compile(r"^(?P<name>[^:]*): invalid (?P<type>\w+) value: '(?P<value>[^']*)'")
_MISSING = re.compile(r"^the following arguments are required: (?P<names>.*)")
_TYPES = {"int": "a whole number", "float": "a number", "number": "a number"}
_OTHER_NAMES = {
    "run": "serve",
    "start": "serve",
    "export": "feel",
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
        # Python before 3.14 takes -1e1 for an option; all versions take -inf for one.
        self._negative_number_matcher = re.compile(r"-(?:\d|\.\d|inf|nan)")

    def parse_known_args(  # type: ignore[override]  # argparse's own has overloads for namespaces
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Refuse an unknown option or a superfluous word in the name of this command."""
        if self._subparsers is not None:
            self._refuse_unknown([*takewhile(lambda word: word.startswith("-"), args or ())])
            return super().parse_known_args(args, namespace)
        self._refuse_unknown(args or ())  # before its value is taken for another argument
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown:
            is_option = unknown[0].startswith("-")
            self.error(f"{unknown[0]}: {'no such option' if is_option else 'one word too many'}")
        return parsed, unknown

    def _refuse_unknown(self, words: Sequence[str]) -> None:
        flags = [flag for action in self._actions for flag in action.option_strings]
        if any(action.nargs == argparse.REMAINDER for action in self._actions):
            return
        for before, word in pairwise(["", *words]):
            name = word.partition("=")[0]
            if not word or (word.startswith("--") and word == f"{name}="):  # "$VARIABLE" not set
                of = name or before
                self.error(f"{of if of.startswith('-') else 'an argument'}: empty; give a value")
            if word == "--":
                return
            if word.startswith("-") and not self._is_known(word, flags):
                self.error(f"{name}: no such option{_nearest(name, flags)}")

    def _is_known(self, word: str, flags: Sequence[str]) -> bool:
        """Whether a word that begins with a dash is -xVALUE, --option, a number, or "-" itself."""
        if word.startswith("--"):
            return any(flag.startswith(word.partition("=")[0]) for flag in flags)
        return word[:2] in ("-", *flags) or bool(self._negative_number_matcher.match(word))

    def _print_message(self, message: str, file: Any = None) -> None:  # noqa: ANN401 - as argparse has it
        """Print help or an error; argparse's own swallows an OSError, such as of a full disk."""
        print(message, end="", file=file or sys.stderr, flush=True)

    def error(self, message: str) -> NoReturn:
        """Print one line that says what is wrong and what to do, and exit with 2."""
        plain = reworded(message)
        cure = "" if "did you mean" in plain else f"; `{self.prog} --help` explains it"
        self.exit(2, f"{self.prog}: {plain}{cure}\n")


def reworded(message: str) -> str:
    """Return argparse's message as what the user wrote, what was wrong, and the nearest choice."""
    message = _ARGUMENT.sub(r"\g<name>: ", message)
    if match := _CHOICE.search(message):
        name, word = match["name"], match["word"]
        choices = [choice.strip(" '") for choice in match["choices"].split(",")]
        near = _nearest(word, choices)
        if name == "COMMAND":
            return f"{word}: no such command{near}"
        return f"{name} `{word}`: choose one of {', '.join(choices)}{near}"
    if match := _VALUE.search(message):
        return f"{match['name']} {match['value']}: must be {_TYPES.get(match['type'], 'valid')}"
    if match := _MISSING.search(message):
        return f"{match['names']} is missing"
    return message.replace("expected one argument", "needs a value")


def _nearest(word: str, choices: Sequence[str]) -> str:
    """Return a suggestion if one choice is similar enough that it can be what was meant."""
    bare = {choice.strip("-"): choice for choice in choices}
    near = [name for name in [_OTHER_NAMES.get(word, "")] if name in choices]
    near = near or get_close_matches(word.strip("-"), bare, 1, cutoff=SIMILARITY)
    return f"; did you mean {bare.get(near[0], near[0])}?" if near else ""


def add_outline(parser: argparse.ArgumentParser) -> None:
    """Declare --no-outline, which leaves things on a plain ground as they are."""
    parser.add_argument(
        "--no-outline",
        dest="outline",
        action="store_false",
        help="do not outline a thing on a plain ground, such as a catalogue photograph's",
    )


def add_encoder(parser: argparse.ArgumentParser) -> None:
    """Declare --encoder, the network that pictures are looked at with."""
    summary = "image network, as in `serve` (the shipped one)"
    parser.add_argument("--encoder", metavar="NAME_OR_FILE", help=summary)


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
