"""Decides an object's surface temperature: stated, from its name, from sun, or ambient. Pure.

The rungs are tried in that order, and each may give None except the last: an object of which
nothing is known is as warm as its surroundings. In the sun an object is warmer than the air by the
sol-air rule (ASHRAE Handbook of Fundamentals; docs/physics.md 7.2),

    rise = a G / (h + k) - s,

with the absorptance a, the sun's power G on the surface, the heat transfer h to air and sky, the
heat k that the body conducts into its depth or evaporates, and the loss s to a clear sky. It is the
steady state on a clear day, which stone reaches in an hour and cloth in minutes. Knows no picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from hapticvlm.evidence import names, temperature_words
from hapticvlm.evidence.ambient import Ambient

# The range of `temperature_c` on the wire; a test compares them.
LEAST_C = -100.0
MOST_C = 400.0
HEATED_ROOM_C = 25.0  # ambient above which radiators are off; our choice

SUN_W_M2 = (400.0, 800.0, 1000.0)  # G: low sun, usual clear day, perpendicular (physics.md 7.2)
AIR_W_M2_K = 17.0  # h of the sol-air rule in a light wind (3.4 m/s); calm air gives about 10
SKY_K = (4.0, 4.0, 0.0)  # s of a horizontal surface, and of a vertical one

Source = Literal["scene", "name", "sun", "ambient"]


@dataclass(frozen=True, slots=True)
class SurfaceFacts:
    """Known facts of an object: `stated_c` in degC; `sunlit` is None if not stated."""

    name: str | None = None
    object_id: str | None = None
    material: str | None = None
    stated_c: float | None = None
    sunlit: bool | None = None


@dataclass(frozen=True, slots=True)
class Surface:
    """A surface temperature and the interval it is believed to lie in, degC; source and reason."""

    value_c: float
    low_c: float
    high_c: float
    source: Source
    why: str


@dataclass(frozen=True, slots=True)
class _Sunning:
    """The least, usual and largest absorptance; and k, W/(m2 K). Sources: physics.md 7.2."""

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
    """Return an object's surface temperature, by the first rung that gives one."""
    known = stated(facts) or named(facts, ambient) or sunned(facts, ambient)
    return known or Surface(
        ambient.value_c,
        ambient.low_c,
        ambient.high_c,
        "ambient",
        f"nothing known of the object: as its surroundings, by {ambient.source}",
    )


def stated(facts: SurfaceFacts) -> Surface | None:
    """Return the temperature that the scene stated; None if it stated none."""
    if facts.stated_c is None:
        return None
    value = facts.stated_c
    return _limited(Surface(value, value, value, "scene", "stated by the scene"))


def named(facts: SurfaceFacts, ambient: Ambient) -> Surface | None:
    """Return the temperature that the name implies (or the object id, without a name), or None.

    A hot object is never colder than hot air, and a cold one never warmer than cold air.
    """
    name = facts.name or facts.object_id
    hot_name = temperature_words.from_name(name) if name else None
    if hot_name is None or (hot_name.is_supposed_on and ambient.value_c > HEATED_ROOM_C):
        return None
    heat = hot_name.heat
    bound = max if heat.is_hot else min
    why = f"`{hot_name.thing}` {hot_name.state}".rstrip() + f": {heat.source}"
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
    """Return the temperature in the sun; None in the shade and for unknown materials."""
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
    """Narrow the absorptance by a colour in the name; also return "dark ", "pale " or ""."""
    words = set(names.words_of(name or ""))
    least, usual, most = absorptance
    if words & _DARK and not words & _PALE:
        return "dark ", (usual, most, most)
    if words & _PALE and not words & _DARK:
        return "pale ", (least, least, usual)
    return "", absorptance


def _limited(surface: Surface) -> Surface:
    """Clamp to the range of the wire, and note it in `why`."""
    value, low, high = (
        min(max(figure, LEAST_C), MOST_C)
        for figure in (surface.value_c, surface.low_c, surface.high_c)
    )
    if (value, low, high) == (surface.value_c, surface.low_c, surface.high_c):
        return surface
    unclamped = f"{surface.value_c:g} ({surface.low_c:g} to {surface.high_c:g}) degC"
    why = f"{surface.why}; {unclamped} clamped to {LEAST_C:g}..{MOST_C:g}"
    return replace(surface, value_c=value, low_c=low, high_c=high, why=why)
