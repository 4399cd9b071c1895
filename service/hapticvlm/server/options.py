"""Describes a setting as an option: its help, its range, the reader of its text.

Settings that may stand in a file too are fields of a dataclass, each with its Flag; command line,
config file and checks all follow from that one declaration.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from hapticvlm import documents

_MOST_BYTES = 65_536  # a calibration has some three hundred


def calibrated(what: str, field: str, command: str) -> Callable[[str], float]:
    """Return an argparse type that reads a number of any range, or the file of a calibration.

    `command` writes the file. The type raises ArgumentTypeError that names what to give.
    """

    def read(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            pass
        try:
            calibration = documents.read_json(Path(text), dict[str, Any], _MOST_BYTES)
        except OSError as error:
            reason = f"{text}: not a number, and as a file: {documents.reason(error)}"
            raise argparse.ArgumentTypeError(reason) from None
        except ValueError:
            calibration = {}
        value: Any = calibration.get(field)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if is_number and calibration.get("calibrate") == what:
            return float(value)
        raise argparse.ArgumentTypeError(f"{text} is not what `hapticvlm {command}` writes")

    return read


plate_resistance = calibrated("plate", "plate_resistance", "calibrate plate --out FILE")
thermal_strength = calibrated("cold", "thermal_strength", "study match FILE")


@dataclass(frozen=True, slots=True)
class Flag:
    """The description of an option: its group, its help without the default, ends of a number.

    `bare` is what the flag without a value means; `names_path`: a name that may also be a folder;
    `env`: the variable that a secret may come from; `read`: what takes the flag's text if not its
    type.
    """

    group: str
    help: str
    metavar: str | None = None
    range: tuple[float, float] | None = None
    bare: str | None = None
    names_path: bool = False
    env: str | None = None
    read: Callable[[str], Any] | None = None


@dataclass(frozen=True, slots=True)
class Option:
    """One setting as flags and files need it; `kind` is its type without None."""

    field: str
    kind: Any
    default: Any
    details: Flag

    @property
    def name(self) -> str:
        """The name in a config file: the flag without the dashes in front."""
        return self.field.replace("_", "-")

    @property
    def flag(self) -> str:
        """The name on the command line."""
        return f"--{self.name}"

    @property
    def choices(self) -> tuple[str, ...]:
        """The words to choose from; empty if the option is not a choice of words."""
        return get_args(self.kind) if get_origin(self.kind) is Literal else ()

    @property
    def accepted(self) -> str:
        """A description of the values it takes, for people."""
        if self.details.range is not None:
            low, high = self.details.range
            return f"a {'whole ' if self.kind is int else ''}number, {low:g}..{high:g}"
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        return _ACCEPTED.get(self.kind, "a text in quotes")


_ACCEPTED = {bool: "true or false", tuple[str, ...]: 'a list of texts, as in ["..."]'}


def options_of(settings: type[Any]) -> tuple[Option, ...]:
    """Return the options that a frozen dataclass declares: each field is annotated by its Flag."""
    hints = get_type_hints(settings, include_extras=True)
    found = []
    for declared in fields(settings):
        # `Annotated[int | None, Flag(...)]` is taken apart: what stands inside the union beside
        # None is the type that a flag and a file are read as. So a setting is declared once, and
        # the command line, the file and the check of both cannot disagree.
        hint, flag = get_args(hints[declared.name])
        kinds = [part for part in get_args(hint) if part is not NoneType]
        is_optional = NoneType in get_args(hint)
        found.append(
            Option(declared.name, kinds[0] if is_optional else hint, declared.default, flag)
        )
    return tuple(found)


def check_ranges(options: Iterable[Option], given: Mapping[str, Any]) -> None:
    """Refuse numbers outside the range of their option. Raises ValueError."""
    for option in options:
        value = given.get(option.field)
        if option.details.range is None or value is None:
            continue
        low, high = option.details.range
        if not low <= value <= high:
            raise ValueError(f"{option.flag} {value:g}: outside {low:g}..{high:g}")
