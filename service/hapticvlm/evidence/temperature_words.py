"""Reads from a name how hot or cold a thing is, by the table temperature_words.toml. Pure.

Some things are hot or cold by themselves (ice), others only in a state (a stove that is on); the
state of a bare name is "". Names are split into words as in names.py. The last thing named is what
a hand touches: a "radiator grille" is a grille, an "ice blue sofa" a sofa, and neither has a
temperature. A thing that may be on or off has one only if a word next to it names the state. A
wrong temperature is worse than none, so an unknown word between a state and a thing, or after the
thing, gives None. Knows no ambient and no sun.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, cast

from hapticvlm import materials
from hapticvlm.evidence import names
from hapticvlm.evidence.lexicon import Lexicon, read_lexicon

State = Literal["", "on", "hot", "boiling", "warm", "cold", "frozen", "inside", "off"]
Run = tuple[str, ...]

TABLE = Path(__file__).with_name("temperature_words.toml")
ROOM_C = 22.0
BARE = "bare"  # in the file: the state of a name without any word of state


@dataclass(frozen=True, slots=True)
class Heat:
    """A surface temperature, the interval that it is believed to lie in, degC, and its source."""

    value_c: float
    low_c: float
    high_c: float
    source: str

    @property
    def is_hot(self) -> bool:
        """Whether it is warmer than a room; no value of the table is near the limit."""
        return self.value_c > ROOM_C


def _runs(words: str) -> list[Run]:
    """Split "ice cube, snow" into [("ice", "cube"), ("snow",)]."""
    return [tuple(run.split()) for run in words.split(",")]


def _heats(table: Mapping[str, Any]) -> dict[str, Heat]:
    return {
        name: Heat(row["value"], row["low"], row["high"], row["source"])
        for name, row in table.items()
    }


def _things(table: list[Any], heats: Mapping[str, Heat]) -> Mapping[Run, Mapping[State, Heat]]:
    rows: dict[Run, Mapping[State, Heat]] = {}
    for row in table:
        states = {
            cast("State", "" if state == BARE else state): heats[name]
            for state, name in row["in_state"].items()
        }
        rows |= dict.fromkeys(_runs(row["names"]), states)
    return MappingProxyType(rows)


def _states(table: Mapping[str, str]) -> Mapping[Run, State]:
    rows = {run: cast("State", state) for state, words in table.items() for run in _runs(words)}
    return MappingProxyType(rows)


_FILE = tomllib.loads(TABLE.read_text(encoding="utf-8"))
_HEATS = _heats(_FILE["temperatures"])
MELTING = _HEATS["melting"]
RADIATOR = _HEATS["radiator"]
THINGS = _things(_FILE["things"], _HEATS)
STATES = _states(_FILE["states"])
WITH = _states(_FILE["with"])
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

Role = Literal["thing", "state", "colour", "mute", "stuff", "tail", "not", "fake", "other"]

_WITH = ("with",)  # the preposition that a state may follow: a mug with steam
_GLASS = ("glass",)  # a thing here, a class word in names.py
_HEATING: tuple[State, ...] = ("boiling", "hot", "on")  # compatible; the first one counts


@dataclass(frozen=True, slots=True)
class HotName:
    """A thing that a name gives, its state ("" if it needs none), and its temperature."""

    thing: str
    state: State
    heat: Heat

    @property
    def is_supposed_on(self) -> bool:
        """Whether it is a radiator without a word of state, which is assumed to be on."""
        return self.heat is RADIATOR and not self.state


@dataclass(frozen=True, slots=True)
class _Token:
    role: Role
    run: Run
    state: State = ""


@lru_cache(maxsize=8192)
def from_name(name: str) -> HotName | None:
    """Return a name's thing and temperature; None if it gives no temperature."""
    main, aside = _clauses(_without_colours(_tokens(name)))
    heads = [at for at, token in enumerate(main) if token.role not in ("state", "colour")]
    if not heads or main[heads[-1]].role != "thing":
        return None
    head = main[heads[-1]]
    figures = THINGS[head.run]
    if _is_imitation(main, figures):
        return None
    state = _agreed(_named_states(main, heads[-1]) | aside)
    heat = None if state is None else figures.get(state)
    return HotName(" ".join(head.run), state or "", heat) if heat else None


def _is_imitation(main: Sequence[_Token], figures: Mapping[State, Heat]) -> bool:
    """Whether a word denies the temperature: a toy stove, an icicle of glass, no fire."""
    roles = {token.role for token in main}
    is_ice = figures.get("") is MELTING
    is_stuff = "stuff" in roles or any(token.run == _GLASS for token in main)
    return bool(roles & {"fake", "not"}) or (is_ice and is_stuff)


def _named_states(main: Sequence[_Token], head: int) -> frozenset[State]:
    """Return the states named after the thing, or before it without an unknown word between."""
    before = takewhile(lambda token: token.role != "other", reversed(main[:head]))
    return frozenset(token.state for token in (*before, *main[head + 1 :]) if token.state)


def _agreed(states: frozenset[State]) -> State | None:
    """Return the one state named; "" if there is none, None if states contradict each other."""
    if len(states) <= 1:
        return next(iter(states), "")
    if states <= set(_HEATING):
        return next(state for state in _HEATING if state in states)
    return None


def _clauses(tokens: Sequence[_Token]) -> tuple[list[_Token], frozenset[State]]:
    """Split at the first preposition; return the tokens before it, and the states after "with"."""
    for at, token in enumerate(tokens):
        if token.role == "tail" or (token.run == ("on",) and _is_followed(tokens[at + 1 :])):
            return list(tokens[:at]), _states_in(tokens[at:])
    return list(tokens), frozenset()


def _is_followed(rest: Sequence[_Token]) -> bool:
    """Whether a thing follows "on": then it is a place, else it means that the thing runs."""
    return any(token.role not in ("state", "colour") for token in rest)


def _states_in(aside: Sequence[_Token]) -> frozenset[State]:
    if aside[0].run != _WITH:
        return frozenset()
    states = {token.state or WITH.get(token.run, "") for token in aside}
    return frozenset(state for state in states if state)


def _without_colours(tokens: Sequence[_Token]) -> list[_Token]:
    """Drop colours that contain a hot or cold word: hot pink, ice blue, off white."""
    kept: list[_Token] = []
    for token in tokens:
        if token.role == "colour" and kept and kept[-1].run in ALSO_COLOURS:
            kept.pop()
        else:
            kept.append(token)
    return kept


def _tokens(name: str) -> list[_Token]:
    """Split a name into known runs of words, the longest first; drops noise and mute words."""
    lexicon = read_lexicon(materials.MATERIALS)
    words = [names.singular_of(word, VOCABULARY) for word in names.words_of(name)]
    tokens = []
    at = 0
    while at < len(words):
        token = next(filter(None, (_token(run, lexicon) for run in _runs_at(words, at))))
        tokens.append(token)
        at += len(token.run)
    return [token for token in tokens if token.role != "mute"]


def _runs_at(words: Sequence[str], at: int) -> Iterator[Run]:
    for length in range(min(LONGEST, len(words) - at), 0, -1):
        yield tuple(words[at : at + length])


def _token(run: Run, lexicon: Lexicon) -> _Token | None:
    """Classify a run; None for a run of several words that is not known."""
    if run in FALSE_FRIENDS:
        return _Token("other", run)
    if run in THINGS:
        return _Token("thing", run)
    if run in STATES:
        return _Token("state", run, STATES[run])
    if run in COLOURS:
        return _Token("colour", run)
    if run in MUTE:
        return _Token("mute", run)
    return _of_grammar(run, lexicon)


def _of_grammar(run: Run, lexicon: Lexicon) -> _Token | None:
    """Classify a run as names.py does: noise, preposition, "not", "faux", class word, phrase."""
    if len(run) > 1:
        return _Token("other", run) if run in lexicon.phrases else None
    word = run[0]
    if run in FAKES:
        return _Token("fake", run)
    if word in lexicon.noise:
        return _Token("mute", run)
    kind = lexicon.items[word].kind if word in lexicon.items else ""
    roles: dict[str, Role] = {"word": "stuff", "tail": "tail", "not": "not", "fake": "fake"}
    return _Token(roles.get(kind, "other"), run)
