"""The material table: what each class is to the skin, to the ear of the palm, and in words.

Knows facts and their sources only; nothing here measures, decides or renders. MATERIALS is the
built-in table and never changes; a material of the user's own is derived from one of its classes,
and whoever uses such materials is handed a table that has them too. Thermal figures are
handbook values at room temperature; docs/physics.md 1.2 has their sources and which of them were
read. Effusivity e = sqrt(k rho c) follows from them.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any

from hapticvlm.errors import HapticVLMError

UNKNOWN = "unknown"

# What a fact of a user's material may be, lowest and highest: from aerogel to diamond and osmium
# for the bulk, the palm's band and what rendering/vibration.py can play for the rest.
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
        "vibration.modes.frequency_hz": (20.0, 1000.0),
        "vibration.modes.decay_per_s": (5.0, 280.0),
        "vibration.modes.gain": (0.01, 1.0),
    }
)
MAX_MODES = 8
MAX_WORDS, MAX_WORD_LETTERS = 64, 60
_NAME = re.compile(r"[a-z0-9_-]{1,40}")


class MaterialError(HapticVLMError, ValueError):
    """A material of the user's that cannot be: which field, why, and what to do."""


@dataclass(frozen=True, slots=True)
class Thermal:
    """Bulk thermal properties: k in W/(m K), rho in kg/m3, c in J/(kg K)."""

    conductivity: float
    density: float
    heat_capacity: float

    @property
    def effusivity(self) -> float:
        """Thermal effusivity in W s^0.5 / (m2 K)."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


@dataclass(frozen=True, slots=True)
class Mode:
    """One decaying mode of an impact: A sin(2 pi f t) exp(-B t), f in Hz, B in 1/s, A relative."""

    frequency_hz: float
    decay_per_s: float
    gain: float


@dataclass(frozen=True, slots=True)
class Vibration:
    """How a class sounds to the palm: impact modes, and the texture felt when rubbed.

    `pitch_m` is the dominant spatial period of the surface, `bandwidth` the width of the texture's
    band relative to its centre frequency speed / pitch, `roughness` how uneven it is (0..1, which
    is how strongly it is felt), `stick` the share that catches and slips under a firm hand,
    `swung_m` how thick the things are that one swings of it.
    """

    modes: tuple[Mode, ...]
    pitch_m: float
    bandwidth: float
    roughness: float
    stick: float = 0.0
    swung_m: float = 0.01


@dataclass(frozen=True, slots=True)
class Material:
    """One class of the table."""

    name: str
    thermal: Thermal
    vibration: Vibration
    words: tuple[str, ...]


_THERMAL = {
    "wood": Thermal(0.18, 700, 1600),  # hardwood (oak, maple) at room moisture
    "glass": Thermal(1.0, 2500, 840),  # soda-lime
    "fabric": Thermal(0.06, 320, 1300),  # cotton; k varies 0.04-0.08
    "metal": Thermal(15.0, 8000, 500),  # stainless 304; all metals feel within 1 degC of it
    "plastic": Thermal(0.18, 1050, 1400),  # ABS
    "stone": Thermal(2.8, 2700, 790),  # granite
    "ceramic": Thermal(1.5, 2400, 1000),  # porcelain
    "paper": Thermal(0.08, 700, 1340),  # cardboard
    "leather": Thermal(0.16, 900, 1500),
    "rubber": Thermal(0.16, 1100, 1900),
    "foliage": Thermal(0.4, 700, 3500),  # fresh leaf, mostly water; no source found
}

# Modes: wood 100 / 80, rubber 30 / 60 and metal (aluminium) 300 / 90 as Okamura, Cutkosky and
# Dennerlein (physics.md 4.3); glass transposes a ringing preset (partials 1 : 1.86) into the band
# of touch; all others are our choice; the first four are set apart by more than the 18-30 % that
# frequencies must differ (physics.md 4.2). Metal's close pair beats, as struck metal does; metal
# rings longest, then glass, then ceramic. A row ends where nobody feels what a struck body's might
# have beyond it (`hapticvlm chart vibration`); the third modes of fabric and leather and the last
# two of rubber are there for that, in the ratios of the glass preset, fabric's weaker, or struck
# cloth would be too near to wood.
# Pitches: our choice, coarse enough to be felt at 0.2 m/s; cloth is woven at 0.3-1 mm.
# Stick: our choice; what squeaks under a dry palm has some.
_VIBRATION = {
    "wood": Vibration((Mode(100, 80, 1.0), Mode(195, 150, 0.5)), 1.6e-3, 0.8, 0.6),
    "glass": Vibration((Mode(350, 22, 1.0), Mode(650, 50, 0.3)), 0.5e-3, 0.2, 0.1, 0.25),
    "fabric": Vibration(
        (Mode(45, 150, 1.0), Mode(80, 200, 0.3), Mode(146, 280, 0.1)), 1.0e-3, 0.5, 0.7
    ),
    "metal": Vibration(
        (Mode(300, 90, 1.0), Mode(232, 10, 0.35), Mode(255, 10, 0.35)), 0.7e-3, 0.3, 0.25, 0.2
    ),
    "plastic": Vibration((Mode(150, 110, 1.0), Mode(310, 180, 0.4)), 0.8e-3, 0.4, 0.4, 0.3),
    "stone": Vibration((Mode(215, 130, 1.0), Mode(380, 150, 0.4)), 2.0e-3, 1.0, 0.8),
    "ceramic": Vibration((Mode(290, 40, 1.0), Mode(560, 80, 0.4)), 0.6e-3, 0.3, 0.2, 0.3),
    "paper": Vibration((Mode(60, 160, 1.0), Mode(180, 250, 0.4)), 0.9e-3, 0.9, 0.3),
    "leather": Vibration(
        (Mode(55, 120, 1.0), Mode(120, 180, 0.2), Mode(179, 280, 0.31)), 1.4e-3, 0.7, 0.5, 0.4
    ),
    "rubber": Vibration(
        (Mode(30, 60, 1.0), Mode(56, 112, 0.54), Mode(98, 196, 0.31)), 1.2e-3, 0.6, 0.8, 0.7
    ),
    "foliage": Vibration((Mode(40, 180, 1.0), Mode(110, 250, 0.5)), 2.4e-3, 1.0, 0.4),
}

# Thickness of what one swings of it, m: stick, rod, cloth, blade, ruler, slab, tile, sheet, belt,
# hose, twig. Our choice (physics.md 4.3); a scene's own thickness counts first.
_SWUNG_M = {
    "wood": 0.016,
    "glass": 0.010,
    "fabric": 0.003,
    "metal": 0.004,
    "plastic": 0.006,
    "stone": 0.030,
    "ceramic": 0.020,
    "paper": 0.002,
    "leather": 0.005,
    "rubber": 0.012,
    "foliage": 0.008,
}

# Words that name the class itself, singular and in lower case; what objects imply is in
# recognition/names.toml.
_WORDS: dict[str, str] = {
    "wood": """
        wood wooden timber lumber plywood hardwood softwood oak pine walnut mahogany birch maple
        beech teak cedar spruce ebony rosewood bamboo rattan wicker driftwood parquet chipboard
        hardboard fibreboard fiberboard mdf osb log plank bark cork
    """,
    "glass": "glass glassware glazing windowpane glasspane crystal plexiglass wineglass hourglass",
    "fabric": """
        fabric cloth textile cotton linen wool woolen woollen silk satin velvet denim canvas felt
        fleece tweed polyester nylon burlap jute lace corduroy chenille cashmere tartan gauze
        muslin upholstery carpet rug curtain drapery tablecloth tapestry knit knitted
    """,
    "metal": """
        metal steel iron aluminium aluminum copper brass bronze chrome chromium titanium zinc
        nickel pewter tungsten cobalt stainless inox galvanized galvanised rust sheetmetal
        ironwork metalwork chainmail
    """,
    "plastic": """
        plastic polymer acrylic polycarbonate pvc vinyl abs polystyrene styrofoam polypropylene
        polyethylene polyurethane bakelite melamine perspex fiberglass fibreglass
    """,
    "stone": """
        stone rock granite marble limestone sandstone slate basalt travertine onyx quartz
        quartzite cobblestone flagstone brick brickwork concrete cement asphalt terrazzo gravel
        pebble boulder masonry stonework stucco plaster gypsum alabaster
    """,
    "ceramic": """
        ceramic porcelain earthenware stoneware terracotta faience majolica tile pottery crockery
    """,
    "paper": "paper cardboard paperboard papyrus parchment wallpaper newspaper",
    "leather": "leather suede nubuck cowhide",
    "rubber": "rubber latex neoprene silicone",
    "foliage": "leaf foliage grass lawn shrub hedge ivy moss fern plant houseplant",
}

MATERIALS = MappingProxyType(
    {
        name: Material(
            name,
            _THERMAL[name],
            replace(_VIBRATION[name], swung_m=_SWUNG_M[name]),
            tuple(_WORDS[name].split()),
        )
        for name in _THERMAL
    }
)


def derive(
    name: str,
    like: str,
    words: object = None,
    facts: Mapping[str, object] = MappingProxyType({}),
) -> Material:
    """Make a user's material from a built-in class; raises MaterialError.

    `facts` replace those of the class, {"thermal": {...}, "vibration": {...}} with the field names
    of Thermal and Vibration, `modes` as a list of maps; `words` is a list, None the name's own.
    """
    _check_name(name)
    parent = MATERIALS.get(like)
    if parent is None:
        raise MaterialError(f"like: no class `{like[:60]}`{_nearest(like, MATERIALS)}")
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
    )


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise MaterialError(f"name: `{name[:60]}` is not 1 to 40 of a-z, 0-9, _ and -; rename it")
    if name in MATERIALS or name == UNKNOWN:
        raise MaterialError(f"name: `{name}` is built in; choose another name")


def _check_fields(path: str, given: object, known: Sequence[str]) -> None:
    if not isinstance(given, Mapping):
        raise MaterialError(f"{path}: expected a table of {', '.join(known)}")
    for field in given:
        if field not in known:
            raise MaterialError(f"{path}{field}: no such fact{_nearest(str(field), known)}")


def _changes(part: str, given: object, parent: Thermal | Vibration) -> dict[str, Any]:
    """Check one table of facts; numbers become floats."""
    _check_fields(f"{part}.", given, [field.name for field in fields(parent)])
    assert isinstance(given, Mapping)
    return {
        field: value if field == "modes" else _number(f"{part}.{field}", value)
        for field, value in given.items()
    }


def _modes(given: object) -> tuple[Mode, ...]:
    path = "vibration.modes"
    if not isinstance(given, list | tuple) or not 1 <= len(given) <= MAX_MODES:
        known = ", ".join(field.name for field in fields(Mode))
        raise MaterialError(f"{path}: expected a list of 1 to {MAX_MODES} maps of {known}")
    for mode in given:
        _check_fields(f"{path}.", mode, [field.name for field in fields(Mode)])
        for field in fields(Mode):
            if field.name not in mode:
                raise MaterialError(f"{path}.{field.name}: missing; add it to every mode")
    return tuple(Mode(**{k: _number(f"{path}.{k}", v) for k, v in m.items()}) for m in given)


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
            text = "is not one or more lower-case words of two letters or more; write"
            raise MaterialError(f"words: `{str(word)[:60]}` {text} letters and single spaces only")
    return tuple(words)


def _is_words(text: str) -> bool:
    """Whether names can have this in them: they are cut into lower-case words of letters."""
    parts = text.split(" ")
    if len(text) > MAX_WORD_LETTERS or text != text.lower():
        return False
    return all(part.isalpha() and len(part) > 1 for part in parts)


def _nearest(name: str, known: Iterable[str]) -> str:
    known = list(known)
    near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.0)
    return f"; nearest is `{near[0]}` of {', '.join(known)}"
