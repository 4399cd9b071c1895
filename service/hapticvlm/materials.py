"""Provides the material table: thermal properties, vibration and words of each material class.

The facts and their sources are in materials.toml; nothing here measures, decides or renders.
MATERIALS is the built-in table and never changes. A user's own material is derived from one of its
classes, and code that supports such materials receives a table that contains them.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hapticvlm.errors import HapticVLMError

UNKNOWN = "unknown"
LIVING = "living"  # a person or an animal, which is believed in but never felt
MAX_SHOWN = 40  # characters of a wrong name in an error
TABLE = Path(__file__).with_name("materials.toml")

# Lowest and highest value of each fact of a user's material. The thermal ranges span aerogel to
# diamond and osmium; the others are the band of the palm and what rendering/vibration can play.
LIMITS = MappingProxyType(
    {
        "thermal.conductivity": (0.005, 2500.0),  # W/(m K)
        "thermal.density": (1.0, 23_000.0),  # kg/m3
        "thermal.heat_capacity": (100.0, 6000.0),  # J/(kg K)
        "vibration.pitch_m": (5e-5, 0.05),
        "vibration.bandwidth": (0.05, 1.5),
        "vibration.roughness": (0.0, 1.0),
        "vibration.stick": (0.0, 0.95),
        "vibration.swung_m": (5e-4, 0.2),
        "vibration.stiffness": (50.0, 1e6),  # N/m
        "vibration.modes.frequency_hz": (20.0, 1000.0),
        "vibration.modes.decay_per_s": (5.0, 280.0),
        "vibration.modes.gain": (0.01, 1.0),
    }
)
MAX_MODES = 8
MAX_WORDS = 64
MAX_WORD_LETTERS = 60
# Bounds of the words of `Material.feels`: our choice, between the classes of the table.
_GRIPPY = 0.7  # stick
_SMOOTH = 0.35  # roughness
_GRAINS = ((0.0025, "coarse"), (0.0012, "grainy"))  # pitch, m
_RINGING_PER_S = 50.0  # decay of the mode that lasts longest
_NAME = re.compile(r"[a-z0-9_-]{1,40}")


class MaterialError(HapticVLMError, ValueError):
    """A user's material is not valid; the message names the field, the reason and what to do."""


@dataclass(frozen=True, slots=True)
class Thermal:
    """Thermal properties of the bulk: k in W/(m K), rho in kg/m3, c in J/(kg K)."""

    conductivity: float
    density: float
    heat_capacity: float

    @property
    def effusivity(self) -> float:
        """Thermal effusivity e = sqrt(k rho c) in W s^0.5 / (m2 K)."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


@dataclass(frozen=True, slots=True)
class Mode:
    """One decaying mode of an impact: A sin(2 pi f t) exp(-B t), f in Hz, B in 1/s, A relative."""

    frequency_hz: float
    decay_per_s: float
    gain: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """Vibration of a class: the modes of an impact, and the texture that is felt when rubbed.

    `pitch_m` is the dominant spatial period of the surface, m. `bandwidth` is the width of the
    texture's band relative to its centre frequency speed / pitch. `roughness` (0..1) is how
    strongly the texture is felt. `stick` (0..1) is the share that catches and slips under a firm
    hand. `swung_m` is the usual thickness of things of it that are swung, m. `stiffness` is the
    force per displacement under a hand, N/m; inf for what does not yield noticeably.
    """

    modes: tuple[Mode, ...]
    pitch_m: float
    bandwidth: float
    roughness: float
    stick: float = 0.0
    swung_m: float = 0.01
    stiffness: float = math.inf


@dataclass(frozen=True, slots=True)
class Material:
    """One class of the table; `words` are the words that name the class itself.

    `like` is the built-in class that a user's material is derived from; None for a class itself.
    """

    name: str
    thermal: Thermal
    vibration: Vibration
    words: tuple[str, ...]
    like: str | None = None

    @property
    def feels(self) -> list[str]:
        """Two plain words: how the surface feels to a stroke, and the body to a tap."""
        felt = self.vibration
        if felt.stick >= _GRIPPY:
            surface = "grippy"
        elif felt.roughness < _SMOOTH:
            surface = "smooth"
        else:
            surface = next((word for pitch_m, word in _GRAINS if felt.pitch_m >= pitch_m), "fine")
        if felt.stiffness < math.inf:
            return [surface, "soft"]
        rings = min(mode.decay_per_s for mode in felt.modes) <= _RINGING_PER_S
        return [surface, "rings" if rings else "knocks"]


def _read() -> Mapping[str, Material]:
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return MappingProxyType({name: _material(name, row) for name, row in table.items()})


def _material(name: str, row: dict[str, Any]) -> Material:
    thermal = Thermal(**row.pop("thermal"))
    words = tuple(row.pop("words").split())
    modes = tuple(Mode(*mode) for mode in row.pop("modes"))
    return Material(name, thermal, Vibration(modes, **row), words)


MATERIALS = _read()


def derive(
    name: str,
    like: str,
    words: object = None,
    facts: Mapping[str, object] = MappingProxyType({}),
) -> Material:
    """Derive a user's material from the built-in class `like`. Raises MaterialError.

    `facts` replace those of the class: {"thermal": {...}, "vibration": {...}} with the field names
    of Thermal and Vibration, and `modes` as a list of maps. `words` is a list of words; None takes
    them from the name.
    """
    _check_name(name)
    parent = MATERIALS.get(like)
    if parent is None:
        raise MaterialError(f"like: no class `{like[:60]}`{nearest(like, MATERIALS)}")
    _check_fields("", facts, ("thermal", "vibration"))
    thermal = _changes("thermal", facts.get("thermal", {}), parent.thermal)
    vibration = _changes("vibration", facts.get("vibration", {}), parent.vibration)
    if "modes" in vibration:
        vibration["modes"] = _modes(vibration["modes"])
    return Material(
        name,
        replace(parent.thermal, **thermal),
        replace(parent.vibration, **vibration),
        _own_words(name) if words is None else _checked_words(words),
        like,
    )


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise MaterialError(f"name: `{name[:60]}` is not 1 to 40 of a-z, 0-9, _ and -; rename it")
    if name in MATERIALS or name in (UNKNOWN, LIVING):
        raise MaterialError(f"name: `{name}` is built in; choose another name")


def _check_fields(path: str, facts: object, known: Sequence[str]) -> None:
    if not isinstance(facts, Mapping):
        raise MaterialError(f"{path}: expected a table of {', '.join(known)}")
    for field in facts:
        if field not in known:
            raise MaterialError(f"{path}{field}: no such fact{nearest(str(field), known)}")


def _changes(part: str, facts: object, parent: Thermal | Vibration) -> dict[str, Any]:
    """Check one table of facts and convert its numbers to float."""
    _check_fields(f"{part}.", facts, [field.name for field in fields(parent)])
    assert isinstance(facts, Mapping)
    return {
        field: value if field == "modes" else _number(f"{part}.{field}", value)
        for field, value in facts.items()
    }


def _modes(modes: object) -> tuple[Mode, ...]:
    path = "vibration.modes"
    if not isinstance(modes, list | tuple) or not 1 <= len(modes) <= MAX_MODES:
        known = ", ".join(field.name for field in fields(Mode))
        raise MaterialError(f"{path}: expected a list of 1 to {MAX_MODES} maps of {known}")
    for mode in modes:
        _check_fields(f"{path}.", mode, [field.name for field in fields(Mode)])
        for field in fields(Mode):
            if field.name not in mode:
                raise MaterialError(f"{path}.{field.name}: missing; add it to every mode")
    return tuple(Mode(**{k: _number(f"{path}.{k}", v) for k, v in m.items()}) for m in modes)


def _number(path: str, value: object) -> float:
    low, high = LIMITS[path]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise MaterialError(f"{path}: {value} is not a number within {low:g}..{high:g}; change it")
    return float(value)


def _own_words(name: str) -> tuple[str, ...]:
    words = re.sub("[_-]+", " ", name).strip()
    return (words,) if _is_words(words) else ()


def _checked_words(words: object) -> tuple[str, ...]:
    if not isinstance(words, list | tuple) or len(words) > MAX_WORDS:
        raise MaterialError(f"words: expected a list of at most {MAX_WORDS} words")
    for word in words:
        if not isinstance(word, str) or not _is_words(word):
            rule = "is not one or more lower-case words of two letters or more; write"
            raise MaterialError(f"words: `{str(word)[:60]}` {rule} letters and single spaces only")
    return tuple(words)


def _is_words(text: str) -> bool:
    """Whether this can occur in names, which are split into lower-case words of letters."""
    parts = text.split(" ")
    if len(text) > MAX_WORD_LETTERS or text != text.lower():
        return False
    return all(part.isalpha() and len(part) > 1 for part in parts)


def find(name: str, known: Mapping[str, Material] = MATERIALS) -> Material:
    """Find a material by name, in any case. Raises MaterialError naming the nearest."""
    material = known.get(name) or known.get(name.lower())
    if material is None:
        raise MaterialError(f"no material `{name[:40]}`{nearest(name, known)}")
    return material


def no_material(name: str, known: Iterable[str]) -> str:
    """Return an error message: there is no such material; the nearest one, and all known ones."""
    return f"no material `{name[:MAX_SHOWN]}`{nearest(name, known)}"


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the end of an error message: the nearest known name, if any, and all known names."""
    known = list(known)
    near = difflib.get_close_matches(name.lower(), known, n=1)
    return "".join(f"; nearest is `{one}`" for one in near) + f"; known: {', '.join(known)}"
