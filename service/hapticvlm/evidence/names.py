"""Infers an object's material from its name or its material's name. Pure.

A name is split into words (at CamelCase, snake_case, kebab-case and digits), and words of engines
are dropped. Each word is looked up in materials.toml (words of a material class) and names.toml
(things, finishes, phrases). They are combined as English builds compounds: the last thing named is
the head, and the words before it modify it, so "wooden handle steel pan" is a steel pan with a
wooden handle. Names in other languages give no evidence. Knows no picture;
`hapticvlm_lab/bench/names.py` measures how often it is right.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

from hapticvlm import materials
from hapticvlm.evidence import ladder
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import Material

Kind = Literal["word", "form", "weak", "thing", "phrase", "part", "tail", "not", "fake", "look", ""]
Distribution = Mapping[str, float]

WORD_BELIEF = 0.93  # how often a class word is right; checked by `hapticvlm measure names`
FAKE = 0.3  # factor on beliefs for "faux leather" or "leather look"
MINOR = 0.1  # weight of words beside the deciding one, and of things beside the head
LEAST_PART = 3  # letters of the shortest part of an unbroken compound

_CAMEL = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")


@dataclass(frozen=True, slots=True)
class _Item:
    kind: Kind
    beliefs: Distribution
    weight: float = 1.0
    words: tuple[str, ...] = ()  # of the name; () if the name denies them


@dataclass(frozen=True, slots=True)
class Lexicon:
    """All known words, of a material table and of names.toml; made by `read_lexicon`."""

    items: Mapping[str, _Item]
    phrases: Mapping[tuple[str, ...], _Item]
    noise: frozenset[str]
    vocabulary: frozenset[str]
    longest: int


def read_lexicon(table: Mapping[str, Material]) -> Lexicon:
    """Collect the words of these materials and of names.toml; results are cached."""
    return _lexicon(tuple(table.values()))


def from_name(name: str, lexicon: Lexicon | None = None) -> Evidence | None:
    """Return a name's evidence; None if no word is known. Default lexicon: built-in materials."""
    if lexicon is None:
        lexicon = read_lexicon(materials.MATERIALS)
    groups = _groups_of(name, lexicon)
    if not groups:
        return None
    head = _head(groups)
    weights = [1.0 if at == head else MINOR for at in range(len(groups))]
    return ladder.ranked("name", _mix([_meaning(group) for group in groups], weights))


def head_words(name: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Return the known words of the head group, in the singular; "faux brick" has none."""
    groups = _groups_of(name, lexicon)
    if not groups:
        return ()
    return tuple(word for item in groups[_head(groups)] for word in item.words)


def words_of(name: str) -> list[str]:
    """Split a name into lower-case words without digits or single letters; non-Latin stay whole."""
    chunks = re.split(r"[\W\d_]+", unicodedata.normalize("NFKC", name))
    cut = (_CAMEL.findall(chunk) if chunk.isascii() else [chunk] for chunk in chunks)
    words = [word for part in cut for word in part]
    return [word.lower() for word in words if len(word) > 1]


def _groups_of(name: str, lexicon: Lexicon) -> list[list[_Item]]:
    return _groups(_tone(_lookup(words_of(name), lexicon)))


def _head(groups: Sequence[Sequence[_Item]]) -> int:
    """Return the index of the head group: the last that is not a part or an aside."""
    return max(range(len(groups)), key=lambda index: (not _is_aside(groups[index]), index))


def _lookup(words: Sequence[str], lexicon: Lexicon) -> list[_Item]:
    """Look up words, longest known phrase first; noise is dropped, unknown words have kind ""."""
    singular = [
        part for word in words for part in _split(singular_of(word, lexicon.vocabulary), lexicon)
    ]
    items: list[_Item] = []
    at = 0
    while at < len(singular):
        runs = [tuple(singular[at : at + n]) for n in range(lexicon.longest, 0, -1)]
        run = next((run for run in runs if run in lexicon.phrases), runs[-1])
        if run in lexicon.phrases or run[0] not in lexicon.noise:
            item = lexicon.phrases.get(run) or lexicon.items.get(run[0], _Item("", {}))
            items.append(replace(item, words=run))
        at += len(run)
    return items


def singular_of(word: str, vocabulary: Container[str]) -> str:
    """Return the singular of a word if the vocabulary has it, else the word itself."""
    endings = (("", ""), ("s", ""), ("es", ""), ("ves", "f"), ("ves", "fe"), ("ies", "y"))
    stems = [word.removesuffix(end) + new for end, new in endings if word.endswith(end)]
    return next((stem for stem in stems if stem in vocabulary), word)


def _split(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Split an unbroken compound of two known words ("oaktable"); else return the word itself."""
    if word in lexicon.vocabulary or len(word) < 2 * LEAST_PART:
        return (word,)
    if word.startswith("non") and word[3:] in lexicon.items:
        return ("non", word[3:])
    for cut in range(len(word) - LEAST_PART, LEAST_PART - 1, -1):
        parts = (word[:cut], singular_of(word[cut:], lexicon.vocabulary))
        kinds = [lexicon.items[part].kind for part in parts if part in lexicon.items]
        if len(kinds) == 2 and all(kind in ("word", "form", "thing") for kind in kinds):
            return parts
    return (word,)


def _tone(items: Iterable[_Item]) -> list[_Item]:
    """Apply "not", "faux" and "look" to their neighbours; drop items without evidence."""
    kept: list[_Item] = []
    pending: Kind = ""
    for item in items:
        if item.kind in ("not", "fake"):
            pending = item.kind
        elif item.kind == "look":
            kept[-1:] = [_scaled(last, FAKE) for last in kept[-1:]]
        elif item.beliefs and pending == "not":
            pending = ""
        elif item.beliefs and pending == "fake":
            kept.append(_scaled(item, FAKE))
            pending = ""
        elif item.beliefs or item.kind in ("part", "tail"):
            kept.append(item)
    return kept


def _scaled(item: _Item, factor: float) -> _Item:
    beliefs = {name: factor * p for name, p in item.beliefs.items()}
    return replace(item, beliefs=beliefs, words=())


def _groups(items: Iterable[_Item]) -> list[list[_Item]]:
    """Form noun groups: each ends with its thing or part; remaining class words join the last.

    Items after "with" and other prepositions get little weight.
    """
    groups: list[list[_Item]] = []
    current: list[_Item] = []
    weight = 1.0
    for item in items:
        if item.kind == "tail":
            weight = MINOR if groups or current else 1.0
            continue
        current.append(replace(item, weight=weight))
        if item.kind in ("thing", "phrase", "part"):
            groups.append(current)
            current = []
    if current and groups and weight == 1.0:
        groups[-1] = groups[-1] + current
    else:
        groups.append(current)
    return [group for group in groups if any(item.beliefs for item in group)]


def _is_aside(group: Sequence[_Item]) -> bool:
    """Whether a group names only a part of something, or follows a preposition."""
    kinds = {item.kind for item in group}
    return ("part" in kinds and not kinds & {"thing", "phrase"}) or all(
        i.weight < 1.0 for i in group
    )


def _meaning(group: Sequence[_Item]) -> Distribution:
    """Return a group's beliefs: class words decide, then forms and phrases, then other items."""
    ranks: tuple[tuple[Kind, ...], ...] = (("word",), ("form", "phrase"), ("thing", "weak"))
    leading = next(rank for rank in ranks if any(i.kind in rank and i.beliefs for i in group))
    items = [item for item in group if item.beliefs]
    weights = [item.weight * (1.0 if item.kind in leading else MINOR) for item in items]
    return _mix([item.beliefs for item in items], weights)


def _mix(parts: Sequence[Distribution], weights: Sequence[float]) -> dict[str, float]:
    total = sum(weights)
    names = {name for part in parts for name in part}
    return {
        name: sum(w * p.get(name, 0.0) for w, p in zip(weights, parts, strict=True)) / total
        for name in names
    }


@lru_cache(maxsize=4)
def _lexicon(known: tuple[Material, ...]) -> Lexicon:
    """Build the lexicon; a user's words override class words, and these override names.toml."""
    with Path(__file__).with_name("names.toml").open("rb") as file:
        table = tomllib.load(file)
    items = _entries("weak", table["weak"]) | _entries("thing", table["things"])
    forms = set(table["grammar"]["form"].split())
    for material in materials.MATERIALS.values():
        for word in material.words:
            kind: Kind = "form" if word in forms else "word"
            items[word] = _Item(kind, {material.name: WORD_BELIEF})
    user_materials = [m for m in known if m.words and m.name not in materials.MATERIALS]
    user_words = _entries(
        "word", {f"{m.name}:{WORD_BELIEF}": ",".join(m.words) for m in user_materials}, ","
    )
    marks: tuple[Kind, ...] = ("part", "tail", "not", "fake", "look")
    for mark in marks:
        items |= {word: _Item(mark, {}) for word in table["grammar"][mark].split()}
    runs = _entries("word", table["stuffs"], ",") | _entries("phrase", table["phrases"], ",")
    phrases = {tuple(run.split()): item for run, item in (runs | user_words).items()}
    items |= {word: item for word, item in user_words.items() if " " not in word}
    vocabulary = frozenset(items) | {word for phrase in phrases for word in phrase}
    noise = frozenset(table["grammar"]["noise"].split())
    return Lexicon(items, phrases, noise, vocabulary | noise, max(map(len, phrases)))


def _entries(kind: Kind, table: Mapping[str, str], comma: str | None = None) -> dict[str, _Item]:
    """Read items of a table "class:probability" -> words; a word under two classes is shared."""
    beliefs: dict[str, list[Distribution]] = {}
    for key, words in table.items():
        name, _, probability = key.partition(":")
        belief = {name: float(probability)} if name else {}
        for word in words.split(comma):
            beliefs.setdefault(word.strip(), []).append(belief)
    return {word: _Item(kind, _mix(parts, [1.0] * len(parts))) for word, parts in beliefs.items()}
