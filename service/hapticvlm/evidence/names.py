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

*Belief.* Each kind of ground (Ground) is scaled to how often it was right in real scenes (`belief`
in names.toml). Knows no picture.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Container, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from hapticvlm import materials
from hapticvlm.evidence import ladder
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.lexicon import (
    GROUNDS,
    UNSPACED,
    Distribution,
    Ground,
    Item,
    Kind,
    Lexicon,
    mix,
    read_lexicon,
)

STRONG = 0.8  # belief of a thing that is hardly ever made of anything else
FAKE = 0.3  # factor on beliefs for "faux leather" or "leather look"
MINOR = 0.1  # weight of words beside the deciding one, and of things beside the head
FROM_PARENT = 0.85  # factor on the belief of a parent that an object without a noun means
LEAST_PART = 3  # letters of the shortest part of an unbroken compound
LEAST_FOREIGN_PART = 4
LEAST_WORD = 3  # letters; shorter unknown words are codes, such as LF
MAX_PARENTS = 8  # parents that are read, from the nearest on

_CAMEL = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
_SLASH = re.compile(r"(?<!\bw)/")  # "Cup w/ lid" is one name
_SIDE = re.compile(r"[\W_]([LRlr])$")
_SIDES = {"l": frozenset(("left",)), "r": frozenset(("right",))}
_GAP = re.compile(r"[\W\d_]+")
_SCRIPT = re.compile(r"[\x00-\x7f]+|[^\x00-\x7f]+")
# What 3ds Max and Maya call a new solid or colour, which artists leave: "Box001", "pPipe3".
_PRIMITIVE = re.compile(
    r"(?:(?:Box|Pyramid|Pipe|Hose|Disc)\d{3}|p(?:Pyramid|Pipe|Gear|Disc)\d+|wire_\d{9})"
)
_ENDING = re.compile(r"[\u3040-\u309f]*")  # hiragana
_VOWEL = re.compile(r"[aeiouy]")  # a word without one is a code: "Fridge_SBS"
# An unknown word that ends as a participle tells what happened to a thing and does not name one, so
# that "Pot_Smashed" is read as a pot. Short words ("seed") and those on -eed ("reed") may name one.
_PARTICIPLE = re.compile(r"[a-z]{3,}[^e\W]ed")
# What a surface's name rests on is trusted more than the same in an object's: "Earth", "Gold".
_OF_SURFACES: dict[Ground, Ground] = {"stuff_before_unknown": "stuff", "weak": "usual"}
_THINGS: frozenset[Kind] = frozenset(("thing", "picky", "phrase"))
_STUFFS: frozenset[Kind] = frozenset(("word", "form"))


@dataclass(frozen=True, slots=True)
class Reading:
    """The material beliefs of one name before calibration, and the ground that they stand on."""

    beliefs: Distribution
    ground: Ground
    words: tuple[str, ...]  # known words of the head group, in the singular


def from_name(
    name: str, lexicon: Lexicon | None = None, surface: str | None = None
) -> Evidence | None:
    """Return the evidence of a name and of its surface's name; None if no word is known.

    A name may be a path, parents first: "Rifle/Magazine". `surface` is the name of its material or
    the file of its texture, and says more than the object's. Default lexicon: built-in materials.
    """
    if lexicon is None:
        lexicon = _built_in()
    both = (_of_surface(surface, name, lexicon) if surface else None, read(name, lexicon))
    readings = [reading for reading in both if reading]
    if not readings:
        return None
    lead = min(readings, key=lambda reading: GROUNDS.index(reading.ground))
    weights = [1.0 if reading is lead else MINOR for reading in readings]
    beliefs = [_scaled_by(reading, lexicon) for reading in readings]
    said = [ladder.ranked("name", each) for each in beliefs]
    if len({each.material for each in said}) == 1:
        return max(said, key=lambda each: each.confidence)
    return ladder.ranked("name", mix(beliefs, weights))


def read(name: str, lexicon: Lexicon) -> Reading | None:
    """Read a name or path; None if it says nothing of matter."""
    *parents, leaf = segments_of(name) or [""]
    parents = parents[-MAX_PARENTS:]
    above = [words_of(parent) for parent in parents]
    if any(_silences(words, lexicon) for words in above):
        return None
    context = _sides_of(leaf) | _singulars(above, lexicon)
    items = _lookup(words_of(leaf), lexicon, context)
    is_from_parent = False
    while above and not any(_is_noun(item) for item in items):
        items = _lookup(above.pop(), lexicon, context) + items
        is_from_parent = True
    reading = _read_items(items)
    return _weakened(reading) if reading and is_from_parent else reading


def _singulars(names: Iterable[Iterable[str]], lexicon: Lexicon) -> frozenset[str]:
    return frozenset(singular_of(word, lexicon.vocabulary) for words in names for word in words)


def _weakened(reading: Reading) -> Reading:
    """Return a reading of which a part stands in a parent's name."""
    return replace(reading, beliefs={m: FROM_PARENT * p for m, p in reading.beliefs.items()})


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
    if _PRIMITIVE.fullmatch(name):
        return []
    if not name.isascii():
        name = _plain_letters(unicodedata.normalize("NFKC", name))
    chunks = _GAP.split(name)
    words = [word for chunk in chunks for word in _cut_case(chunk)]
    return [word.lower() for word in words if len(word) > 1 or UNSPACED.match(word)]


def _cut_case(chunk: str) -> list[str]:
    """Cut at capitals, and between Latin letters and other scripts."""
    if chunk.isascii():
        return _CAMEL.findall(chunk)
    runs = _SCRIPT.findall(chunk) if UNSPACED.search(chunk) else [chunk]
    return [word for run in runs for word in (_CAMEL.findall(run) if run.isascii() else [run])]


@lru_cache(maxsize=1)
def _built_in() -> Lexicon:
    return read_lexicon(materials.MATERIALS)


def _of_surface(surface: str, name: str, lexicon: Lexicon) -> Reading | None:
    """Read a material's or texture's name: what it is made of may stand anywhere in it.

    The object's name and parents are its context.
    """
    reading = read(f"{name}/{surface}" if _is_clean(name, lexicon) else surface, lexicon)
    own = read(surface, lexicon)
    if own is None:
        return None
    reading = reading or own
    return replace(reading, ground=_OF_SURFACES.get(reading.ground, reading.ground))


def _is_clean(name: str, lexicon: Lexicon) -> bool:
    return not any(_silences(words_of(part), lexicon) for part in segments_of(name))


def _scaled_by(reading: Reading, lexicon: Lexicon) -> dict[str, float]:
    """Scale beliefs to how often their ground is right."""
    total = sum(reading.beliefs.values())
    scale = min(lexicon.scale[reading.ground], 1.0 / total if total > 0.0 else 1.0)
    return {material: scale * p for material, p in reading.beliefs.items()}


def _silences(words: Sequence[str], lexicon: Lexicon) -> bool:
    """Whether a parent is an engine's: "PauseMenu", "UI Root", but not "MenuRoom"."""
    nouns = [word for word in words if word not in lexicon.plain]
    return bool(nouns) and nouns[-1] in lexicon.silences


def _is_noun(item: Item) -> bool:
    return item.kind not in ("part", "plain", "tail", "not", "look")


def _lookup(
    words: Sequence[str], lexicon: Lexicon, context: Collection[str] = frozenset()
) -> list[Item]:
    """Look up words, longest known phrase first; noise and plain words are dropped."""
    singular = [part for word in words for part in _parts_of(word, lexicon)]
    items: list[Item] = []
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


def _item_at(words: Sequence[str], at: int, lexicon: Lexicon) -> tuple[tuple[str, ...], Item]:
    """Return the longest known run of words from this position on, and its item."""
    for length in range(min(lexicon.longest, len(words) - at), 1, -1):
        run = tuple(words[at : at + length])
        item = lexicon.phrases.get(run)
        if item is None and length == 2:  # "SunFlower"
            item = lexicon.items.get("".join(run)) if min(map(len, run)) > 2 else None
            item = item or _catalogued(run, lexicon)
        if item is not None:
            return run, item
    word = words[at]
    foreign = lexicon.foreign.get(singular_of(word, lexicon.foreign))
    return (word,), lexicon.items.get(word) or foreign or _engine(word, lexicon)


def _catalogued(run: tuple[str, ...], lexicon: Lexicon) -> Item | None:
    """Return the thing of two words in the order of a catalogue: "Table_Coffee"."""
    item = lexicon.phrases.get(run[::-1])
    last = lexicon.items.get(run[1])
    is_detail = last is not None and last.kind in ("plain", "part")  # "Board_White", "Lamp_Head"
    return item if item is not None and item.kind == "phrase" and not is_detail else None


def _engine(word: str, lexicon: Lexicon) -> Item:
    """Return the item of an unknown word: a class name of an engine, a code, or unknown."""
    if word.endswith(lexicon.suffixes):
        return Item("mark", {})
    is_code = word.isascii() and (len(word) < LEAST_WORD or not _VOWEL.search(word))
    return Item("plain" if is_code or _PARTICIPLE.fullmatch(word) else "", {})


def singular_of(word: str, vocabulary: Container[str]) -> str:
    """Return the singular of a word if the vocabulary has it, else the word itself."""
    if word in vocabulary:
        return word
    endings = (("s", ""), ("es", ""), ("ves", "f"), ("ves", "fe"), ("ies", "y"))
    stems = [word.removesuffix(end) + new for end, new in endings if word.endswith(end)]
    return next((stem for stem in stems if stem in vocabulary), word)


def _parts_of(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Return the known words that a word consists of, in the singular."""
    if not word.isascii() and UNSPACED.search(word):
        return _cut_unspaced(word, lexicon)
    return _split(singular_of(word, lexicon.vocabulary), lexicon)


def _plain_letters(word: str) -> str:
    """Drop the accents of Latin letters, as file names do; other scripts stay as they are."""
    letters = unicodedata.normalize("NFD", word)
    kept = "".join(c for c in letters if not "\u0300" <= c <= "\u036f")
    return unicodedata.normalize("NFC", kept.replace("\u00df", "ss"))


def _cut_unspaced(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Find known words in a text without spaces, the longest first from left to right.

    What is left at the end is an unknown head, unless it is an ending in hiragana.
    """
    parts: list[str] = []
    at = end = 0
    while at < len(word):
        lengths = range(min(lexicon.longest_unspaced, len(word) - at), 0, -1)
        known = (word[at : at + n] for n in lengths)
        part = next((run for run in known if run in lexicon.foreign), "")
        if part:
            parts.append(part)
            end = at + len(part)
        at += max(1, len(part))
    if parts and not _ENDING.fullmatch(word[end:]):
        parts.append(word[end:])
    return tuple(parts) or (word,)


def _split(word: str, lexicon: Lexicon) -> tuple[str, ...]:
    """Split an unbroken compound of two known words ("oaktable"); else return the word itself."""
    if word in lexicon.vocabulary or len(word) < 2 * LEAST_PART:
        return (word,)
    if word.startswith("non") and word[3:] in lexicon.items:
        return ("non", word[3:])
    for cut in range(len(word) - LEAST_PART, LEAST_PART - 1, -1):
        first, last = word[:cut], singular_of(word[cut:], lexicon.vocabulary)
        item = lexicon.items.get(last)
        if _is_part(item) and _is_part(lexicon.items.get(first)):
            return (first, last)
        if item is not None and item.kind == "word" and first in lexicon.plain:  # "blacksteel"
            return (first, last)
    return (word,) if word in lexicon.foreign else _split_german(word, lexicon)


def _is_part(item: Item | None) -> bool:
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


def _read_items(items: Sequence[Item]) -> Reading | None:
    if any(item.kind == "mark" for item in items):
        return None
    toned = _tone(items)
    last = _head_item(toned)
    groups = _groups(toned)
    if last is None or not groups:
        return None
    group = groups[_head(groups)]
    if _says_nothing(last, group, toned):
        return None
    words = tuple(word for item in group for word in item.words)
    return Reading(_mixed(groups, group), _ground_before(last, group), words)


def _mixed(groups: Sequence[Sequence[Item]], head: Sequence[Item]) -> Distribution:
    """Return what all groups mean, in which the head group counts in full."""
    weights = [1.0 if each is head else MINOR for each in groups]
    return mix([_meaning(each) for each in groups], weights)


def _says_nothing(last: Item, group: Sequence[Item], items: Sequence[Item]) -> bool:
    """Whether the last noun takes the meaning from the words before it."""
    if last.kind == "void":
        return not _has_stuff(group)
    return last.kind == "picky" and _is_modified(items, last)


def _has_stuff(group: Sequence[Item]) -> bool:
    return any(item.kind in _STUFFS and item.beliefs for item in group)


def _head_item(items: Sequence[Item]) -> Item | None:
    """Return the last item before a preposition that is not a part; a part if there is no other."""
    tails = [at for at, item in enumerate(items) if item.kind == "tail" and at > 0]
    main = [item for item in items[: tails[0] if tails else None] if item.kind != "tail"]
    nouns = [item for item in main if item.kind != "part"] or main
    return nouns[-1] if nouns else None


def _is_modified(items: Sequence[Item], last: Item) -> bool:
    """Whether an unknown word or another thing precedes: "BuggyController" is a script."""
    before = items[: next(at for at, item in enumerate(items) if item is last)]
    return any(
        item.kind in ("", "void")
        or (item.kind in _THINGS and item.beliefs.keys() != last.beliefs.keys())
        for item in before
    )


def _ground_before(last: Item, group: Sequence[Item]) -> Ground:
    """Return the ground of the head group, which is weaker before a noun that says nothing."""
    if last.kind not in ("void", "") or any(item.head_first for item in group):
        return _ground(group)
    return "stuff_before_unknown" if _has_stuff(group) else "thing_before_unknown"


def _ground(group: Sequence[Item]) -> Ground:
    leading = _leading(group)
    if leading & _STUFFS:
        return "stuff"
    if leading == {"weak"}:
        return "weak"
    best = max(
        (p for item in group if item.kind in _THINGS for p in item.beliefs.values()), default=0.0
    )
    return "thing" if best >= STRONG else "usual"


def _head(groups: Sequence[Sequence[Item]]) -> int:
    """Return the index of the head group: the last that is not a part or an aside."""
    return max(range(len(groups)), key=lambda index: (not _is_aside(groups[index]), index))


def _tone(items: Iterable[Item]) -> list[Item]:
    """Apply "not", "faux" and "look" to their neighbours, and drop them; an agent drops its own."""
    kept: list[Item] = []
    pending: Kind = ""
    for item in items:
        if item.kind in ("not", "fake"):
            pending = item.kind
        elif item.kind == "look":
            kept[-1:] = [_scaled(last, FAKE) for last in kept[-1:]]
        elif item.kind == "agent":
            kept[-1:] = [replace(item, kind="void")]
        elif item.beliefs and pending == "not":
            pending = ""
        elif item.beliefs and pending == "fake":
            kept.append(_scaled(item, FAKE))
            pending = ""
        else:
            kept.append(item)
    return kept


def _scaled(item: Item, factor: float) -> Item:
    beliefs = {name: factor * p for name, p in item.beliefs.items()}
    return replace(item, beliefs=beliefs, words=())


def _groups(items: Iterable[Item]) -> list[list[Item]]:
    """Form noun groups: each ends with its thing or part; remaining class words join the last.

    Items after "with" and other prepositions get little weight.
    """
    groups: list[list[Item]] = []
    current: list[Item] = []
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
    if groups and weight == 1.0:
        whole = next((g for g in reversed(groups) if not _is_aside(g)), groups[-1])
        whole += current  # "FloorBaseGrass": of grass is the floor
    else:
        groups.append(current)
    return [group for group in groups if _has_beliefs(group)]


def _has_beliefs(group: Sequence[Item]) -> bool:
    return any(item.beliefs for item in group)


def _is_aside(group: Sequence[Item]) -> bool:
    """Whether a group names only a part of something, or follows a preposition."""
    kinds = {item.kind for item in group}
    return ("part" in kinds and not kinds & _THINGS) or all(i.weight < 1.0 for i in group)


def _leading(group: Sequence[Item]) -> frozenset[Kind]:
    """Return the kinds that decide: class words, then forms and phrases, then other items."""
    ranks: tuple[frozenset[Kind], ...] = (
        frozenset(("word",)),
        frozenset(("form", "phrase")),
        frozenset(("thing", "picky")),
        frozenset(("weak",)),
    )
    kinds = {item.kind for item in group if item.beliefs}
    return next(rank for rank in ranks if rank & kinds) & kinds


def _meaning(group: Sequence[Item]) -> Distribution:
    """Return a group's beliefs: class words decide, then forms and phrases, then other items."""
    leading = _leading(group)
    if leading <= {"thing", "picky", "weak"}:
        leading = frozenset(("thing", "picky", "weak"))
    items = [item for item in group if item.beliefs]
    weights = [item.weight * (1.0 if item.kind in leading else MINOR) for item in items]
    return mix([item.beliefs for item in items], weights)
