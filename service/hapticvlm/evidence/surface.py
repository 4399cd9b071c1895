"""Surface temperature of an object: stated by the scene, its name, sun, the ambient. Pure.

The rungs are climbed in that order and each may give None; the last always gives a value, so that
an object of which nothing is known is as warm as its surroundings. In the sun an object is warmer
than the air by the sol-air rule (ASHRAE Handbook of Fundamentals; docs/physics.md 7.2):
    rise = a G / (h + k) - s
with a the absorptance, G the sun's power on it, h the heat transfer to air and sky, k what a body
leads into its depth or evaporates, s the loss to a clear sky. It is a steady state on a clear day:
an hour of sun for stone, minutes for cloth. Knows no picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from hapticvlm.evidence import names, temperature_words
from hapticvlm.evidence.ambient import Ambient

# what `temperature_c` may be on the wire; a test compares them
LEAST_C = -100.0
MOST_C = 400.0
HEATED_ROOM_C = 25.0  # above this nobody heats: a radiator gives nothing; our choice

SUN_W_M2 = (400.0, 800.0, 1000.0)  # low sun, usual clear day, at right angles (physics.md 7.2)
AIR_W_M2_K = 17.0  # h of the sol-air rule in a light wind (3.4 m/s); calm air gives about 10
SKY_K = (4.0, 4.0, 0.0)  # s of a horizontal surface, and of a vertical one

Source = Literal["scene", "name", "sun", "ambient"]


@dataclass(frozen=True, slots=True)
class SurfaceFacts:
    """What is known of an object: `stated_c` in degC; `sunlit` None when not stated."""

    name: str | None = None
    object_id: str | None = None
    material: str | None = None
    stated_c: float | None = None
    sunlit: bool | None = None


@dataclass(frozen=True, slots=True)
class Surface:
    """A surface temperature, the interval it is believed to lie in, its source and why; degC."""

    value_c: float
    low_c: float
    high_c: float
    source: Source
    why: str


@dataclass(frozen=True, slots=True)
class _Sunning:
    """Absorptance least, usual, most; and k in W/(m2 K). Sources: physics.md 7.2."""

    absorptance: tuple[float, float, float]
    depth_w_m2_k: float = 0.0


_PAINT = (0.3, 0.6, 0.9)  # white, middling, black paint and bare metal alike
_SUNNING = {
    "wood": _Sunning((0.4, 0.6, 0.85), 2.0),
    "glass": _Sunning((0.05, 0.1, 0.4)),  # clear panes let the sun through
    "fabric": _Sunning(_PAINT),
    "metal": _Sunning(_PAINT),
    "plastic": _Sunning(_PAINT),
    "stone": _Sunning((0.4, 0.65, 0.93), 8.0),  # white marble to fresh asphalt
    "ceramic": _Sunning((0.3, 0.6, 0.85), 5.0),
    "paper": _Sunning((0.25, 0.35, 0.7)),
    "leather": _Sunning((0.5, 0.75, 0.92)),
    "rubber": _Sunning((0.8, 0.92, 0.95), 2.0),
    "foliage": _Sunning((0.4, 0.5, 0.6), 25.0),  # leaves cool themselves by evaporation
}
_DARK = frozenset(("black", "dark", "asphalt", "tarmac", "charcoal", "basalt", "soot"))
_PALE = frozenset(("white", "pale", "ivory", "cream", "whitewashed", "limewashed"))


def surface(facts: SurfaceFacts, ambient: Ambient) -> Surface:
    """Return how warm an object's surface is, by the first rung that gives a value."""
    found = stated(facts) or named(facts, ambient) or sunned(facts, ambient)
    return found or Surface(
        ambient.value_c,
        ambient.low_c,
        ambient.high_c,
        "ambient",
        f"nothing known of the object: as its surroundings, by {ambient.source}",
    )


def stated(facts: SurfaceFacts) -> Surface | None:
    """Return the temperature that the scene stated; None: none stated."""
    if facts.stated_c is None:
        return None
    value = facts.stated_c
    return _limited(Surface(value, value, value, "scene", "stated by the scene"))


def named(facts: SurfaceFacts, ambient: Ambient) -> Surface | None:
    """Return what the name gives, or the object id where there is no name; None: nothing.

    In hot air nothing hot is colder than the air, in cold air nothing cold is warmer.
    """
    name = facts.name or facts.object_id
    found = temperature_words.from_name(name) if name else None
    if found is None or (found.is_supposed_on and ambient.value_c > HEATED_ROOM_C):
        return None
    heat = found.heat
    bound = max if heat.is_hot else min
    why = f"`{found.thing}` {found.state}".rstrip() + f": {heat.source}"
    return _limited(
        Surface(
            bound(heat.value_c, ambient.value_c),
            bound(heat.low_c, ambient.low_c),
            bound(heat.high_c, ambient.high_c),
            "name",
            why,
        )
    )


def sunned(facts: SurfaceFacts, ambient: Ambient) -> Surface | None:
    """Return how warm the sun makes it; None in the shade and for unknown materials."""
    known = _SUNNING.get(facts.material or "")
    if not facts.sunlit or known is None:
        return None
    shade, absorptance = _shaded(facts.name, known.absorptance)
    rises = [
        max(0.0, share * sun / (AIR_W_M2_K + known.depth_w_m2_k) - sky)
        for share, sun, sky in zip(absorptance, SUN_W_M2, SKY_K, strict=True)
    ]
    return _limited(
        Surface(
            ambient.value_c + rises[1],
            ambient.low_c + rises[0],
            ambient.high_c + rises[2],
            "sun",
            f"{shade}{facts.material} in the sun: sol-air rule, {rises[1]:.0f} K above ambient",
        )
    )


def _shaded(
    name: str | None, absorptance: tuple[float, float, float]
) -> tuple[str, tuple[float, float, float]]:
    """Narrow the absorptance by a colour in the name: ("dark ", ...), ("pale ", ...) or as is."""
    words = set(names.words_of(name or ""))
    least, usual, most = absorptance
    if words & _DARK and not words & _PALE:
        return "dark ", (usual, most, most)
    if words & _PALE and not words & _DARK:
        return "pale ", (least, least, usual)
    return "", absorptance


def _limited(found: Surface) -> Surface:
    """Clamp to what the wire declares, and note it in `why`."""
    value, low, high = (
        min(max(figure, LEAST_C), MOST_C) for figure in (found.value_c, found.low_c, found.high_c)
    )
    if (value, low, high) == (found.value_c, found.low_c, found.high_c):
        return found
    unclamped = f"{found.value_c:g} ({found.low_c:g} to {found.high_c:g}) degC"
    why = f"{found.why}; {unclamped} clamped to {LEAST_C:g}..{MOST_C:g}"
    return replace(found, value_c=value, low_c=low, high_c=high, why=why)
