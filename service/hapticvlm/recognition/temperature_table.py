"""Words of names that give how hot or cold a thing is: reads temperature_words.toml. Pure.

A thing is hot or cold by itself or only in a state; the state of the bare name is "". Reads no
name; that is `temperature_words`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, cast

State = Literal["", "on", "hot", "boiling", "warm", "cold", "frozen", "inside", "off"]
Run = tuple[str, ...]

TABLE = Path(__file__).with_name("temperature_words.toml")
ROOM_C = 22.0
BARE = "bare"  # in the file, the state of a name that states none


@dataclass(frozen=True, slots=True)
class Heat:
    """A surface temperature and the interval it is believed to lie in, degC, and its source."""

    value_c: float
    low_c: float
    high_c: float
    source: str

    @property
    def is_hot(self) -> bool:
        """Whether it is warmer than a room, not colder; no figure lies near the limit."""
        return self.value_c > ROOM_C


def _runs(words: str) -> list[Run]:
    """Cut "ice cube, snow" into (("ice", "cube"), ("snow",))."""
    return [tuple(run.split()) for run in words.split(",")]


def _heats(table: Mapping[str, Any]) -> dict[str, Heat]:
    return {
        name: Heat(row["value"], row["low"], row["high"], row["source"])
        for name, row in table.items()
    }


def _things(table: list[Any], heats: Mapping[str, Heat]) -> Mapping[Run, Mapping[State, Heat]]:
    found: dict[Run, Mapping[State, Heat]] = {}
    for row in table:
        states = {
            cast("State", "" if state == BARE else state): heats[name]
            for state, name in row["in_state"].items()
        }
        found |= dict.fromkeys(_runs(row["names"]), states)
    return MappingProxyType(found)


def _states(table: Mapping[str, str]) -> Mapping[Run, State]:
    found = {run: cast("State", state) for state, words in table.items() for run in _runs(words)}
    return MappingProxyType(found)


_FILE = tomllib.loads(TABLE.read_text(encoding="utf-8"))
_HEATS = _heats(_FILE["temperatures"])
MELTING, RADIATOR = _HEATS["melting"], _HEATS["radiator"]
THINGS = _things(_FILE["things"], _HEATS)
STATES, WITH = _states(_FILE["states"]), _states(_FILE["with"])
COLOURS, ALSO_COLOURS, MUTE, FALSE_FRIENDS, FAKES = (
    frozenset(_runs(_FILE["words"][key]))
    for key in ("colours", "also_colours", "mute", "false_friends", "fakes")
)
VOCABULARY = frozenset(
    word
    for runs in (THINGS, STATES, WITH, COLOURS, MUTE, FALSE_FRIENDS, FAKES)
    for run in runs
    for word in run
)
LONGEST = max(map(len, THINGS))
