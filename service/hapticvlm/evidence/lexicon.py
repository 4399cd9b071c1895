"""Holds the words that names are read with: their kinds, beliefs and senses. Pure.

Words come from materials.toml (class words), names.toml (things, finishes, phrases, senses),
engine_words.toml (words of engines) and languages.toml (eight other languages); the files say what
each list means. English wins over other languages, class words over things, and a user's own words
over all. `evidence/names.py` combines the words of a name.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from hapticvlm import materials
from hapticvlm.materials import Material

Kind = Literal[
    "word", "form", "weak", "thing", "picky", "phrase", "part", "tail", "not", "fake", "look",
    "agent", "void", "mark", "plain", "",
]  # fmt: skip
Ground = Literal["stuff", "stuff_before_unknown", "thing", "usual", "thing_before_unknown", "weak"]
Distribution = Mapping[str, float]


# Grounds by how far they are trusted; of a node's and its material's name the better one leads.
GROUNDS: tuple[Ground, ...] = (
    "stuff",
    "thing",
    "usual",
    "stuff_before_unknown",
    "weak",
    "thing_before_unknown",
)

WORD_BELIEF = 0.93  # of a class word, before the scale of its ground

# Scripts without spaces between words: kana, Chinese characters, Hangul.
UNSPACED = re.compile(r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7a3]")


@dataclass(frozen=True, slots=True)
class Item:
    """A known word or run of words: what it does to a name, and the materials that it implies.

    `words` are those of the name that it was read from, none if the name denies them ("faux").
    `head_first`: it is of a language in which adjectives follow their noun.
    """

    kind: Kind
    beliefs: Distribution
    weight: float = 1.0
    words: tuple[str, ...] = ()
    head_first: bool = False


class Sense(NamedTuple):
    """What a word means beside one of these words."""

    context: frozenset[str]
    item: Item


@dataclass(frozen=True, slots=True)
class Lexicon:
    """All known words, of a material table and of the files beside; made by `read_lexicon`.

    `noise` are file suffixes and the like; `vocabulary` all English words. `silences` are parents
    whose children are the engine's. `scale` is the factor on the beliefs of each ground.
    """

    items: Mapping[str, Item]
    phrases: Mapping[tuple[str, ...], Item]
    noise: frozenset[str]
    vocabulary: frozenset[str]
    longest: int
    foreign: Mapping[str, Item] = field(repr=False)
    longest_unspaced: int
    senses: Mapping[str, tuple[Sense, ...]] = field(repr=False)
    suffixes: tuple[str, ...]
    silences: frozenset[str]
    plain: frozenset[str]
    scale: Mapping[Ground, float]


def read_lexicon(table: Mapping[str, Material]) -> Lexicon:
    """Collect the words of these materials and of the files; results are cached."""
    return _lexicon(tuple(table.values()))


@lru_cache(maxsize=4)
def _lexicon(known: tuple[Material, ...]) -> Lexicon:
    """Build the lexicon; what is read later overrides what was read before."""
    table, engine, world = map(_toml, ("names", "engine_words", "languages"))
    grammar, noise = table["grammar"], table["grammar"]["noise"].split()
    engine_runs = _engine_runs(engine)
    phrases = engine_runs | _phrases(table)
    items = _all("plain", engine["plain"])
    # Phrases are written as one word as well: "piggybank".
    joined = {"".join(run): item for run, item in phrases.items()}
    items |= {word: joined[word] for word in joined if len(word) > 6 or (word,) in phrases}
    items |= _all("part", engine["part"])
    items |= {run[0]: item for run, item in engine_runs.items() if len(run) == 1}
    items |= _entries("weak", table["weak"]) | _entries("thing", table["things"])
    items |= {word: replace(items[word], kind="picky") for word in engine["picky"].split()}
    items |= _class_words(frozenset(grammar["form"].split()))
    items |= _all("void", grammar["both"])
    marks: tuple[Kind, ...] = ("part", "tail", "not", "fake", "look", "agent")
    for mark in marks:
        items |= _all(mark, grammar[mark])
    items |= dict.fromkeys(noise, Item("plain", {}))
    users = [m for m in known if m.words and m.name not in materials.MATERIALS]
    own = _entries("word", {f"{m.name}:{WORD_BELIEF}": ",".join(m.words) for m in users}, ",")
    phrases |= {tuple(run.split()): item for run, item in own.items()}
    items |= {word: item for word, item in own.items() if " " not in word}
    foreign = _foreign_items(world, items)
    return Lexicon(
        items=items,
        phrases=phrases,
        noise=frozenset(noise),
        vocabulary=frozenset(items) | {word for phrase in phrases for word in phrase},
        longest=max(map(len, phrases)),
        foreign=foreign,
        longest_unspaced=max(len(word) for word in foreign if UNSPACED.search(word)),
        senses=_senses(table["senses"], table["groups"]),
        suffixes=tuple(engine["suffixes"].split()),
        silences=frozenset(engine["silences"].split()),
        plain=frozenset(word for word, item in items.items() if item.kind == "plain"),
        scale=table["belief"],
    )


def _toml(name: str) -> dict[str, Any]:
    with Path(__file__).with_name(f"{name}.toml").open("rb") as file:
        return tomllib.load(file)


def _all(kind: Kind, words: str) -> dict[str, Item]:
    return dict.fromkeys(words.split(), Item(kind, {}))


def _class_words(forms: Container[str]) -> dict[str, Item]:
    """Return the words that name a class itself, such as "oak", or a form of it, such as "log"."""
    return {
        word: Item("form" if word in forms else "word", {material.name: WORD_BELIEF})
        for material in materials.MATERIALS.values()
        for word in material.words
    }


def _engine_runs(engine: Mapping[str, str]) -> dict[tuple[str, ...], Item]:
    """Read the marks and void heads of engine_words.toml, of one word or several."""
    kinds: tuple[Kind, ...] = ("mark", "void")
    rows = [(tuple(run.split()), kind) for kind in kinds for run in engine[kind].split(",")]
    return {run: Item(kind, {}) for run, kind in rows}


def _phrases(table: Mapping[str, Mapping[str, str]]) -> dict[tuple[str, ...], Item]:
    """Read the stuffs, phrases, colours ("plain") and phrases without a material ("")."""
    things = dict(table["phrases"])
    items = {run: Item("void", {}) for run in things.pop("").split(",")}
    items |= {run: Item("plain", {}) for run in things.pop("plain").split(",")}
    items |= _entries("word", table["stuffs"], ",") | _entries("phrase", things, ",")
    return {tuple(run.split()): item for run, item in items.items()}


def _senses(table: Mapping[str, str], groups: Mapping[str, str]) -> dict[str, tuple[Sense, ...]]:
    """Read "word: context; word: context" of each sense; "@name" stands for a group's words."""
    senses: dict[str, list[Sense]] = {}
    for key, rows in table.items():
        for name, words in groups.items():
            rows = rows.replace(f"@{name}", words)
        for row in rows.split(";"):
            word, _, context = row.partition(":")
            belief = _belief_of(key)
            item = Item("thing", belief) if belief else Item("void", {})
            senses.setdefault(word.strip(), []).append(Sense(frozenset(context.split()), item))
    return {word: tuple(rows) for word, rows in senses.items()}


def _foreign_items(world: Mapping[str, Any], english: Mapping[str, Item]) -> dict[str, Item]:
    """Give the words of other languages the items of the English ones; synonyms may be shared."""
    columns, head_first = world["columns"].split(), world["head_first"].split()
    shared: dict[str, list[Item]] = {}
    for key, row in (*world["materials"].items(), *world["things"].items()):
        items = [replace(english[key], head_first=first) for first in (False, True)]
        for language, words in zip(columns, row.split(), strict=True):
            for word in words.split("|"):
                shared.setdefault(word, []).append(items[language in head_first])
    del shared["-"]
    words = {word: _shared_item(same) for word, same in shared.items() if word not in english}
    grammar = world["grammar"]
    return _all("plain", grammar["plain"]) | _all("tail", grammar["tail"]) | words


def _shared_item(same: Sequence[Item]) -> Item:
    """Return one item for a word of several classes or languages, with the mean of beliefs."""
    if len(same) == 1:
        return same[0]
    beliefs = mix([item.beliefs for item in same], [1.0] * len(same))
    return Item(same[0].kind, beliefs, head_first=any(item.head_first for item in same))


def _belief_of(key: str) -> dict[str, float]:
    """Read "class:probability"; "" has no beliefs."""
    name, _, probability = key.partition(":")
    return {name: float(probability)} if name else {}


def _entries(kind: Kind, table: Mapping[str, str], comma: str | None = None) -> dict[str, Item]:
    """Read items of a table "class:probability" -> words; a word under two classes is shared."""
    items: dict[str, list[Item]] = {}
    for key, words in table.items():
        item = Item(kind, _belief_of(key))
        for word in words.split(comma):
            items.setdefault(word.strip(), []).append(item)
    return {word: _shared_item(same) for word, same in items.items()}


def mix(parts: Sequence[Distribution], weights: Sequence[float]) -> dict[str, float]:
    """Return the weighted mean of beliefs; a material that a part does not name has belief 0."""
    total = sum(weights)
    names = {name for part in parts for name in part}
    return {
        name: sum(w * p.get(name, 0.0) for w, p in zip(weights, parts, strict=True)) / total
        for name in names
    }
