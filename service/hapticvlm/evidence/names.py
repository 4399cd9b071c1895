"""Infers an object's material from its name, its parents' names and its materials' names. Pure.

A name is split into words (at CamelCase, snake_case, kebab-case and digits). Each is looked up in
materials.toml (words of a material class), names.toml (things, finishes, phrases),
engine_words.toml (words of engines) and languages.toml (eight other languages). They are combined
as English builds compounds: the last thing named is the head, and the words before it modify it, so
"wooden handle steel pan" is a steel pan with a wooden handle.

*Engine words.* A mark ("Sound", "Icon", "SnapZone") takes all meaning from a name. A void head
("Area", "Water") has no material itself. Plain words (colours, sides, "Visuals") change nothing.

*Unknown heads.* If the last word is unknown, the words before it only modify it: a "car ..." can be
anything, a "steel ..." probably is steel. Such a belief stays below SURE, so other rungs are asked.

*Paths.* "Hand/Nails" is an object under its parents. They choose the sense of an ambiguous word;
an engine's parent ("Canvas") silences its children; and a name that says only "Visuals" or "Mesh"
means its parent.

*Belief.* Each kind of ground (_Ground) is scaled to how often it was right in real scenes
(`belief` in names.toml; `hapticvlm measure names --csv` fits and checks it). Knows no picture.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

from hapticvlm import materials
from hapticvlm.evidence import ladder
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import Material

Kind = Literal[
    "word", "form", "weak", "thing", "picky", "phrase", "part", "tail", "not", "fake", "look",
    "void", "mark", "plain", "",
]  # fmt: skip
Ground = Literal["stuff", "stuff_before_unknown", "thing", "usual", "thing_before_unknown", "weak"]
Distribution = Mapping[str, float]

WORD_BELIEF = 0.93  # of a class word, before the scale of its ground
STRONG = 0.8  # belief of a thing that is hardly ever made of anything else
FAKE = 0.3  # factor on beliefs for "faux leather" or "leather look"
MINOR = 0.1  # weight of words beside the deciding one, and of things beside the head
FROM_PARENT = 0.85  # factor on the belief of a parent that an object without a noun means
LEAST_PART = 3  # letters of the shortest part of an unbroken compound
LEAST_FOREIGN_PART = 4
LEAST_WORD = 3  # letters; shorter unknown words are codes, such as LF
MAX_PARENTS = 8  # parents that are read, from the nearest on

# Grounds by how far they are trusted; of a node's and its material's name the better one leads.
GROUNDS: tuple[Ground, ...] = (
    "stuff",
    "thing",
    "usual",
    "stuff_before_unknown",
    "weak",
    "thing_before_unknown",
)

_CAMEL = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
_SLASH = re.compile(r"(?<!\bw)/")  # "Cup w/ lid" is one name
_SIDE = re.compile(r"[\W_]([LRlr])$")
_SIDES = {"l": frozenset(("left",)), "r": frozenset(("right",))}
_GAP = re.compile(r"[\W\d_]+")
# Scripts without spaces between words: kana, Chinese characters, Hangul.
_UNSPACED = re.compile(r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7a3]")
_SCRIPT = re.compile(r"[\x00-\x7f]+|[^\x00-\x7f]+")
_THINGS: frozenset[Kind] = frozenset(("thing", "picky", "phrase"))
_STUFFS: frozenset[Kind] = frozenset(("word", "form"))


@dataclass(frozen=True, slots=True)
class _Item:
    kind: Kind
    beliefs: Distribution
    weight: float = 1.0
    words: tuple[str, ...] = ()  # of the name; () if the name denies them
    head_first: bool = False  # of a language in which adjectives follow their noun


_UNKNOWN = _Item("", {})


class _Sense(NamedTuple):
    context: frozenset[str]
    item: _Item


@dataclass(frozen=True, slots=True)
class Lexicon:
    """All known words, of a material table and of the files beside; made by `read_lexicon`."""

    items: Mapping[str, _Item]
    phrases: Mapping[tuple[str, ...], _Item]
    noise: frozenset[str]
    vocabulary: frozenset[str]
    longest: int
    foreign: Mapping[str, _Item] = field(repr=False)
    longest_unspaced: int
    senses: Mapping[str, tuple[_Sense, ...]] = field(repr=False)
    suffixes: tuple[str, ...]
    marks: frozenset[str]  # parents that silence their children
    scale: Mapping[Ground, float]


@dataclass(frozen=True, slots=True)
class Reading:
    """The material beliefs of one name before calibration, and the ground that they stand on."""

    beliefs: Distribution
    ground: Ground
    words: tuple[str, ...]  # known words of the head group, in the singular


def read_lexicon(table: Mapping[str, Material]) -> Lexicon:
    """Collect the words of these materials and of the files; results are cached."""
    return _lexicon(tuple(table.values()))


def from_name(
    name: str, lexicon: Lexicon | None = None, surface: str | None = None
) -> Evidence | None:
    """Return the evidence of a name and of its surface's name; None if no word is known.

    A name may be a path, parents first: "Rifle/Magazine". `surface` is the name of its material or
    the file of its texture, and says more than the object's. Default lexicon: built-in materials.
    """
    if lexicon is None:
        lexicon = _built_in()
    readings = [reading for reading in (
        _of_surface(surface, name, lexicon) if surface else None, read(name, lexicon)
    ) if reading]  # fmt: skip
    if not readings:
        return None
    lead = min(readings, key=lambda reading: GROUNDS.index(reading.ground))
    weights = [1.0 if reading is lead else MINOR for reading in readings]
    return ladder.ranked("name", _mix([_scaled_by(r, lexicon) for r in readings], weights))


def read(name: str, lexicon: Lexicon) -> Reading | None:
    """Read a name or path; None if it says nothing of matter."""
    *parents, leaf = segments_of(name) or [""]
    parents = parents[-MAX_PARENTS:]
    above = [words_of(parent) for parent in parents]
    if any(_silences(words, lexicon) for words in above):
        return None
    context = _sides_of(leaf) | {
        singular_of(word, lexicon.vocabulary) for words in above for word in words
    }
    items = _lookup(words_of(leaf), lexicon, context)
    factor = 1.0
    while above and not any(_is_noun(item) for item in items):
        items = _lookup(above.pop(), lexicon, context) + items
        factor = FROM_PARENT
    reading = _read_items(items)
    if reading is None or factor == 1.0:
        return reading
    return replace(reading, beliefs={m: factor * p for m, p in reading.beliefs.items()})


def _sides_of(name: str) -> frozenset[str]:
    """Return {"left"} for "Palm_L", as rigs mark a side; {"right"} for R; else nothing."""
    side = _SIDE.search(name)
    return _SIDES[side.group(1).lower()] if side else frozenset()


def head_words(name: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Return the known words of the head group, in the singular; "faux brick" has none."""
    reading = read(name, lexicon)
    return reading.words if reading else ()


def segments_of(path: str) -> list[str]:
    """Split a path at its slashes, parents first; empty parts are dropped."""
    if "/" not in path:
        return [path]
    return [part for part in _SLASH.split(path) if part.strip()]


def words_of(name: str) -> list[str]:
    """Split the last part of a path into lower-case words, without digits or single letters.

    Words of scripts without spaces, such as Japanese, stay whole.
    """
    if "/" in name:
        name = (segments_of(name) or [""])[-1]
    if not name.isascii():
        name = _plain_letters(unicodedata.normalize("NFKC", name))
    chunks = _GAP.split(name)
    words = [word for chunk in chunks for word in _cut_case(chunk)]
    return [word.lower() for word in words if len(word) > 1 or _UNSPACED.match(word)]


def _cut_case(chunk: str) -> list[str]:
    """Cut at capitals, and between Latin letters and other scripts."""
    if chunk.isascii():
        return _CAMEL.findall(chunk)
    runs = _SCRIPT.findall(chunk) if _UNSPACED.search(chunk) else [chunk]
    return [word for run in runs for word in (_CAMEL.findall(run) if run.isascii() else [run])]


def _of_surface(surface: str, name: str, lexicon: Lexicon) -> Reading | None:
    """Read a material's or texture's name: what it is made of may stand anywhere in it.

    The object's name and parents are its context.
    """
    reading = read(f"{name}/{surface}" if _is_clean(name, lexicon) else surface, lexicon)
    own = read(surface, lexicon)
    if own is None:
        return None
    reading = reading or own
    is_stuff = reading.ground == "stuff_before_unknown"
    return replace(reading, ground="stuff") if is_stuff else reading


def _is_clean(name: str, lexicon: Lexicon) -> bool:
    return not any(_silences(words_of(part), lexicon) for part in segments_of(name))


def _scaled_by(reading: Reading, lexicon: Lexicon) -> dict[str, float]:
    """Scale beliefs to how often their ground is right."""
    total = sum(reading.beliefs.values())
    scale = min(lexicon.scale[reading.ground], 1.0 / total if total > 0.0 else 1.0)
    return {material: scale * p for material, p in reading.beliefs.items()}


def _silences(words: Sequence[str], lexicon: Lexicon) -> bool:
    return any(word in lexicon.marks for word in words)


def _is_noun(item: _Item) -> bool:
    return item.kind not in ("part", "plain", "tail", "not", "look")


def _lookup(
    words: Sequence[str], lexicon: Lexicon, context: Collection[str] = frozenset()
) -> list[_Item]:
    """Look up words, longest known phrase first; noise and plain words are dropped."""
    singular = [part for word in words for part in _parts_of(word, lexicon)]
    items: list[_Item] = []
    at = 0
    while at < len(singular):
        run, item = _item_at(singular, at, lexicon)
        at += len(run)
        if item.kind == "plain":
            continue
        for sense in lexicon.senses.get(run[-1], ()):
            if not sense.context.isdisjoint(context) or any(
                word in sense.context for word in singular
            ):
                item = sense.item
                break
        items.append(replace(item, words=run))
    return items


def _item_at(words: Sequence[str], at: int, lexicon: Lexicon) -> tuple[tuple[str, ...], _Item]:
    """Return the longest known run of words from this position on, and its item."""
    for length in range(min(lexicon.longest, len(words) - at), 1, -1):
        run = tuple(words[at : at + length])
        item = lexicon.phrases.get(run)
        if item is None and length == 2:  # "SunFlower"
            item = lexicon.items.get("".join(run)) if min(map(len, run)) > 2 else None
        if item is not None:
            return run, item
    word = words[at]
    return (word,), lexicon.items.get(word) or lexicon.foreign.get(word) or _engine(word, lexicon)


def _engine(word: str, lexicon: Lexicon) -> _Item:
    """Return the item of an unknown word: a class name of an engine, a code, or unknown."""
    if word.endswith(lexicon.suffixes):
        return _Item("mark", {})
    return _UNKNOWN if len(word) >= LEAST_WORD else _Item("plain", {})


def singular_of(word: str, vocabulary: Container[str]) -> str:
    """Return the singular of a word if the vocabulary has it, else the word itself."""
    if word in vocabulary:
        return word
    endings = (("s", ""), ("es", ""), ("ves", "f"), ("ves", "fe"), ("ies", "y"))
    stems = [word.removesuffix(end) + new for end, new in endings if word.endswith(end)]
    return next((stem for stem in stems if stem in vocabulary), word)


def _parts_of(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Return the known words that a word consists of, in the singular."""
    if not word.isascii() and _UNSPACED.search(word):
        return _cut_unspaced(word, lexicon)
    return _split(singular_of(word, lexicon.vocabulary), lexicon)


def _plain_letters(word: str) -> str:
    """Drop the accents of Latin letters, as file names do; other scripts stay as they are."""
    letters = unicodedata.normalize("NFD", word)
    kept = "".join(c for c in letters if not "\u0300" <= c <= "\u036f")
    return unicodedata.normalize("NFC", kept.replace("\u00df", "ss"))


def _cut_unspaced(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Find known words in a text without spaces, the longest first from left to right."""
    parts: list[str] = []
    at = 0
    while at < len(word):
        lengths = range(min(lexicon.longest_unspaced, len(word) - at), 0, -1)
        known = (word[at : at + n] for n in lengths)
        part = next((run for run in known if run in lexicon.foreign), "")
        if part:
            parts.append(part)
        at += max(1, len(part))
    return tuple(parts) or (word,)


def _split(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Split an unbroken compound of two known words ("oaktable"); else return the word itself."""
    if word in lexicon.vocabulary or len(word) < 2 * LEAST_PART:
        return (word,)
    if word.startswith("non") and word[3:] in lexicon.items:
        return ("non", word[3:])
    for cut in range(len(word) - LEAST_PART, LEAST_PART - 1, -1):
        first, last = word[:cut], singular_of(word[cut:], lexicon.vocabulary)
        if _is_part(lexicon.items.get(first)) and _is_part(lexicon.items.get(last)):
            return (first, last)
    return (word,) if word in lexicon.foreign else _split_german(word, lexicon)


def _is_part(item: _Item | None) -> bool:
    return item is not None and (item.kind in _STUFFS or item.kind == "thing")


def _split_german(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Split a German compound ("Eichentisch"); its last word decides, the first may be unknown."""
    for cut in range(LEAST_FOREIGN_PART, len(word) - LEAST_FOREIGN_PART + 1):
        last = word[cut:]
        item = lexicon.foreign.get(last) or lexicon.items.get(last)
        if item is None or item.head_first or not item.beliefs:
            continue
        stems = (word[:cut].removesuffix(link) for link in ("", "n", "en", "s", "es"))
        first = next((stem for stem in stems if stem in lexicon.foreign), "")
        if first:
            return (first, last)
        if last in lexicon.foreign and len(last) > LEAST_FOREIGN_PART:
            return (word[:cut], last)
    return (word,)


def _read_items(items: Sequence[_Item]) -> Reading | None:
    if any(item.kind == "mark" for item in items):
        return None
    toned = _tone(items)
    last = _head_item(toned)
    groups = _groups(toned)
    if last is None or not groups:
        return None
    group = groups[_head(groups)]
    is_stuff = any(item.kind in _STUFFS and item.beliefs for item in group)
    is_bare = last.kind in ("void", "")
    if last.kind == "void" and not is_stuff:
        return None
    if last.kind == "picky" and _is_modified(toned, last):
        return None
    weights = [1.0 if each is group else MINOR for each in groups]
    beliefs = _mix([_meaning(each) for each in groups], weights)
    if is_bare and not any(item.head_first for item in group):
        ground: Ground = "stuff_before_unknown" if is_stuff else "thing_before_unknown"
        total = sum(beliefs.values())  # how surely a modifier is of its material matters little
        beliefs = {material: p / total for material, p in beliefs.items()}
    else:
        ground = _ground(group)
    return Reading(beliefs, ground, tuple(word for item in group for word in item.words))


def _head_item(items: Sequence[_Item]) -> _Item | None:
    """Return the last item before a preposition that is not a part; a part if there is no other."""
    main = list(items)
    for at, item in enumerate(items):
        if item.kind == "tail" and at > 0:
            main = main[:at]
            break
    main = [item for item in main if item.kind != "tail"]
    nouns = [item for item in main if item.kind != "part"]
    return (nouns or main or [None])[-1]


def _is_modified(items: Sequence[_Item], last: _Item) -> bool:
    """Whether an unknown word or another thing precedes: "BuggyController" is a script."""
    before = items[: next(at for at, item in enumerate(items) if item is last)]
    return any(
        item.kind in ("", "void") or (item.kind in _THINGS and item.beliefs.keys() != last.beliefs.keys())
        for item in before
    )


def _ground(group: Sequence[_Item]) -> Ground:
    leading = _leading(group)
    if leading & _STUFFS:
        return "stuff"
    if leading == {"weak"}:
        return "weak"
    best = max(
        (p for item in group if item.kind in _THINGS for p in item.beliefs.values()), default=0.0
    )
    return "thing" if best >= STRONG else "usual"


def _head(groups: Sequence[Sequence[_Item]]) -> int:
    """Return the index of the head group: the last that is not a part or an aside."""
    return max(range(len(groups)), key=lambda index: (not _is_aside(groups[index]), index))


def _tone(items: Iterable[_Item]) -> list[_Item]:
    """Apply "not", "faux" and "look" to their neighbours, and drop them."""
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
        else:
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
        if not item.beliefs and item.kind != "part":
            continue
        current.append(replace(item, weight=weight))
        if item.kind in _THINGS or item.kind == "part":
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
    return ("part" in kinds and not kinds & _THINGS) or all(i.weight < 1.0 for i in group)


def _leading(group: Sequence[_Item]) -> frozenset[Kind]:
    """Return the kinds that decide: class words, then forms and phrases, then other items."""
    ranks: tuple[frozenset[Kind], ...] = (
        frozenset(("word",)),
        frozenset(("form", "phrase")),
        frozenset(("thing", "picky")),
        frozenset(("weak",)),
    )
    kinds = {item.kind for item in group if item.beliefs}
    return next(rank for rank in ranks if rank & kinds) & kinds


def _meaning(group: Sequence[_Item]) -> Distribution:
    """Return a group's beliefs: class words decide, then forms and phrases, then other items."""
    leading = _leading(group)
    if leading <= {"thing", "picky", "weak"}:
        leading = frozenset(("thing", "picky", "weak"))
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
    """Build the lexicon; a user's words override all others, and class words override things."""
    table, engine, world = map(_toml, ("names", "engine_words", "languages"))
    items, phrases = _engine_items(engine)
    items |= _entries("weak", table["weak"]) | _entries("thing", table["things"])
    picky = {word: items[word] for word in map(str.strip, engine["picky"].split(",")) if word in items}
    items |= {word: replace(item, kind="picky") for word, item in picky.items()}
    forms = set(table["grammar"]["form"].split())
    for material in materials.MATERIALS.values():
        for word in material.words:
            kind: Kind = "form" if word in forms else "word"
            items[word] = _Item(kind, {material.name: WORD_BELIEF})
    items |= {word: _Item("void", {}) for word in table["grammar"]["both"].split()}
    marks: tuple[Kind, ...] = ("part", "tail", "not", "fake", "look")
    for mark in marks:
        items |= {word: _Item(mark, {}) for word in table["grammar"][mark].split()}
    phrases |= _phrases(table)
    # Phrases are written as one word as well: "piggybank".
    joined = {"".join(run): item for run, item in phrases.items() if len("".join(run)) > 6}
    items = joined | items
    items |= {word: _Item("plain", {}) for word in table["grammar"]["noise"].split()}
    plain = engine["plain"].split()
    items = {word: _Item("plain", {}) for word in plain} | items
    users = [m for m in known if m.words and m.name not in materials.MATERIALS]
    own = _entries("word", {f"{m.name}:{WORD_BELIEF}": ",".join(m.words) for m in users}, ",")
    phrases |= {tuple(run.split()): item for run, item in own.items()}
    items |= {word: item for word, item in own.items() if " " not in word}
    vocabulary = frozenset(items) | {word for phrase in phrases for word in phrase}
    foreign = _foreign_items(world, items)
    return Lexicon(
        items=items,
        phrases=phrases,
        noise=frozenset(table["grammar"]["noise"].split()),
        vocabulary=vocabulary,
        longest=max(map(len, phrases)),
        foreign=foreign,
        longest_unspaced=max(len(word) for word in foreign if _UNSPACED.search(word)),
        senses=_senses(table["senses"]),
        suffixes=tuple(engine["suffixes"].split()),
        marks=frozenset(engine["silences"].split()),
        scale=table["belief"],
    )


@lru_cache(maxsize=1)
def _built_in() -> Lexicon:
    return read_lexicon(materials.MATERIALS)


def _toml(name: str) -> dict[str, dict[str, str]]:
    with Path(__file__).with_name(f"{name}.toml").open("rb") as file:
        return tomllib.load(file)


def _engine_items(
    engine: Mapping[str, str],
) -> tuple[dict[str, _Item], dict[tuple[str, ...], _Item]]:
    """Read the parts, marks and void heads of engine_words.toml."""
    items = {word: _Item("part", {}) for word in engine["part"].split()}
    phrases = {}
    kinds: tuple[Kind, ...] = ("mark", "void")
    for kind in kinds:
        for words in engine[kind].split(","):
            run = tuple(words.split())
            if len(run) > 1:
                phrases[run] = _Item(kind, {})
            else:
                items[run[0]] = _Item(kind, {})
    return items, phrases


def _phrases(table: Mapping[str, Mapping[str, str]]) -> dict[tuple[str, ...], _Item]:
    """Read the stuffs, phrases, colours ("plain") and phrases without a material ("")."""
    things = dict(table["phrases"])
    items = {run: _Item("void", {}) for run in things.pop("").split(",")}
    items |= {run: _Item("plain", {}) for run in things.pop("plain").split(",")}
    items |= _entries("word", table["stuffs"], ",") | _entries("phrase", things, ",")
    return {tuple(run.split()): item for run, item in items.items()}


def _senses(table: Mapping[str, str]) -> dict[str, tuple[_Sense, ...]]:
    """Read "word: context; word: context" of each sense."""
    senses: dict[str, list[_Sense]] = {}
    for key, rows in table.items():
        for row in rows.split(";"):
            word, _, context = row.partition(":")
            belief = _belief_of(key)
            item = _Item("thing", belief) if belief else _Item("void", {})
            senses.setdefault(word.strip(), []).append(_Sense(frozenset(context.split()), item))
    return {word: tuple(rows) for word, rows in senses.items()}


def _foreign_items(
    world: Mapping[str, dict[str, str] | str], english: Mapping[str, _Item]
) -> dict[str, _Item]:
    """Give the words of other languages the items of the English ones; synonyms may be shared."""
    columns, head_first = str(world["columns"]).split(), str(world["head_first"]).split()
    grammar, tables = world["grammar"], (world["materials"], world["things"])
    shared: dict[str, list[_Item]] = {}
    assert isinstance(grammar, dict)
    for table in tables:
        assert isinstance(table, dict)
        for key, row in table.items():
            for language, words in zip(columns, row.split(), strict=True):
                item = replace(english[key], head_first=language in head_first)
                for word in words.replace("-", "").split("|"):
                    shared.setdefault(word, []).append(item)
    shared.pop("", None)
    items = {word: _shared_item(same) for word, same in shared.items() if word not in english}
    plain: dict[str, Kind] = dict.fromkeys(grammar["plain"].split(), "plain")
    plain |= dict.fromkeys(grammar["tail"].split(), "tail")
    return {word: _Item(kind, {}) for word, kind in plain.items()} | items


def _shared_item(same: Sequence[_Item]) -> _Item:
    """Return one item for a word of several languages, with the mean of their beliefs."""
    beliefs = _mix([item.beliefs for item in same], [1.0] * len(same))
    return _Item(same[0].kind, beliefs, head_first=any(item.head_first for item in same))


def _belief_of(key: str) -> dict[str, float]:
    """Read "class:probability"; "" has no beliefs."""
    name, _, probability = key.partition(":")
    return {name: float(probability)} if name else {}


def _entries(kind: Kind, table: Mapping[str, str], comma: str | None = None) -> dict[str, _Item]:
    """Read items of a table "class:probability" -> words; a word under two classes is shared."""
    beliefs: dict[str, list[Distribution]] = {}
    for key, words in table.items():
        for word in words.split(comma):
            beliefs.setdefault(word.strip(), []).append(_belief_of(key))
    return {word: _Item(kind, _mix(parts, [1.0] * len(parts))) for word, parts in beliefs.items()}
