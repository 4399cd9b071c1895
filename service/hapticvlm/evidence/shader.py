"""Infers a material from a shader's physically based parameters. Pure."""

from __future__ import annotations

from itertools import pairwise

from hapticvlm import materials
from hapticvlm.evidence.ladder import Evidence, ranked

METALLIC = 0.9  # from this value on it is bare metal, through which no light passes
# Metallic and the belief in metal, linear between (our choice). Artists write .8 to .85 for steel
# and chrome. Below the first nothing is said: of 889 materials of game kits at .1 to .5, 42 % are
# metal.
DEGREES = ((0.4, 0.5), (0.5, 0.6), (0.7, 0.8), (0.9, 0.9), (1.0, 0.9))
# Exporters that turn shininess into roughness leave glTF's metallic of 1: of 65 surfaces with that
# and a roughness from the first figure on, the share of the second is metal.
CONVERTED = (0.9, 0.4)
DARK = 2 / 3  # of the belief where the base colour is darker than that of any bare metal
DIELECTRIC = 0.1  # up to this value it is not bare metal
BLENDED = (0.02, 0.7)  # opacity of panes; less is not seen, more is often a label or soft edges
TRANSMISSIVE = 0.5  # from this value on light passes through the object


def from_shader(
    metallic: float | None,
    roughness: float | None,
    transmission: float | None,
    base_color: tuple[float, float, float] | None,
    opacity: float | None = None,
) -> Evidence | None:
    """Return the evidence of parameters (0..1, or None: not stated); None if they imply nothing.

    metallic 1 with roughness 1 or unstated is glTF's default, which textured wood has as often as
    metal, so it implies nothing.
    """
    if (transmission or 0.0) >= TRANSMISSIVE and (metallic or 0.0) < METALLIC:
        clear = {"glass": 0.75, "plastic": 0.15}  # not sure by itself: acrylic and water are clear
        frosted = {"glass": 0.55, "plastic": 0.3}
        return ranked("shader", frosted if (roughness or 0.0) > 0.3 else clear)
    if opacity is not None and BLENDED[0] <= opacity <= BLENDED[1] and (metallic or 0.0) < METALLIC:
        # Smoke, water and plastic are blended too.
        return ranked("shader", {"glass": 0.6, "plastic": 0.15})
    if metallic is None or (metallic == 1.0 and roughness in (None, 1.0)):
        return None
    if metallic > DEGREES[0][0]:
        is_dark = base_color is not None and max(base_color) < 0.1
        belief = _metal(metallic) * (DARK if is_dark else 1.0)
        if metallic == 1.0 and (roughness or 0.0) >= CONVERTED[0]:
            belief = CONVERTED[1]
        return ranked("shader", {"metal": belief})
    if metallic <= DIELECTRIC:
        return ranked("shader", _dielectric(roughness))
    return None


def _metal(metallic: float) -> float:
    """Return the belief in metal by DEGREES."""
    for (low, below), (high, above) in pairwise(DEGREES):
        if metallic <= high:
            return below + (above - below) * (metallic - low) / (high - low)
    return DEGREES[-1][1]


def _dielectric(roughness: float | None) -> dict[str, float]:
    """Return even beliefs with less metal; smooth is seldom cloth or paper, rough seldom glass."""
    doubt = {"metal": 0.3}
    if roughness is not None and roughness <= 0.2:
        doubt |= dict.fromkeys(("fabric", "paper", "rubber", "foliage"), 0.5)
    if roughness is not None and roughness >= 0.7:
        doubt |= {"glass": 0.4, "ceramic": 0.7}
    odds = {name: doubt.get(name, 1.0) for name in materials.MATERIALS}
    return {name: value / sum(odds.values()) for name, value in odds.items()}
