"""Surfaces, independent of any renderer, and their construction from a texture.

Colours are sRGB 0..1 in maps and linear 0..1 in triples. A map repeats every 1 / `repeat` scene
units; a relief's depth is in scene units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm_lab.training.held_back.catalogue import Texture
from hapticvlm_lab.training.held_back.patterns import SIDE, Plane

Rng = np.random.Generator
Triple = tuple[float, float, float]
Map = NDArray[np.float32]

GREY = np.array([0.299, 0.587, 0.114], np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Relief:
    """A height map (H, W) 0..1 and its depth in scene units."""

    height: Plane
    depth: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Opaque:
    """A surface that light does not pass: colour (H, W, 3) sRGB or a linear triple."""

    made_of: str
    colour: Map | Triple
    roughness: Plane | float = 0.5
    metallic: Plane | float = 0.0
    specular: float = 0.5
    coat: float = 0.0
    sheen: float = 0.0
    relief: Relief | None = None
    repeat: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Conductor:
    """A bare metal by its complex index of refraction; rougher across (v) than along (u)."""

    made_of: str
    eta: Triple
    k: Triple
    rough_u: float
    rough_v: float
    relief: Relief | None = None
    repeat: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Clear:
    """A transparent surface: index of refraction, tint per crossing, roughness (0: polished)."""

    made_of: str
    ior: float
    tint: Triple
    roughness: float = 0.0
    relief: Relief | None = None
    repeat: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Glowing:
    """A surface that emits light and cannot be touched."""

    made_of: str
    colour: Triple


Surface = Opaque | Conductor | Clear | Glowing


@lru_cache(maxsize=512)
def read_map(path: Path, *, side: int = SIDE) -> Map:
    """Read a texture map as (side, side, 3) float32 0..1, not to be changed."""
    image = Image.open(path).convert("RGB").resize((side, side), Image.Resampling.BICUBIC)
    read = np.asarray(image, np.float32) / np.float32(255)
    read.flags.writeable = False
    return read


def dressed(rng: Rng, texture: Texture, *, depth: float = 0.02) -> Opaque:
    """Build a surface of a held-back texture: its maps, or heights guessed from its lightness."""
    colour = read_map(texture.maps["albedo"])
    surface = Opaque(
        made_of=f"{texture.kind}: {texture.name}",
        colour=colour,
        roughness=_roughness(texture, rng),
        metallic=_metallic(texture),
        repeat=rng.uniform(0.45, 1.0),
    )
    height = read_map(texture.maps["height"]) if "height" in texture.maps else colour
    return replace(
        surface, relief=Relief(height=lightness(height), depth=depth * rng.uniform(0.5, 1))
    )


def lightness(colour: Map) -> Plane:
    """Grey of (H, W, 3), stretched to 0..1."""
    grey = colour @ GREY
    low = float(grey.min())
    high = float(grey.max())
    return (grey - low) / max(high - low, 0.05)


def mixed(low: Triple, high: Triple, share: Plane) -> Map:
    """Blend two linear colours by (H, W) 0..1 into an sRGB map (H, W, 3)."""
    linear = np.array(low) + (np.array(high) - np.array(low)) * share[..., None]
    return to_srgb(linear)


def to_srgb(linear: NDArray[np.floating]) -> Map:
    """Encode linear 0..1 as sRGB 0..1 (IEC 61966-2-1)."""
    x = np.clip(linear, 0, 1)
    coded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    return np.asarray(coded, np.float32)


def to_linear(coded: NDArray[np.floating]) -> Map:
    """Decode sRGB 0..1."""
    x = np.clip(coded, 0, 1)
    return np.asarray(np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4), np.float32)


def any_colour(rng: Rng, *, saturation: tuple[float, float] = (0.3, 0.9)) -> Triple:
    """Draw a linear colour of any hue."""
    hue = rng.uniform(0, 6)
    most = rng.uniform(0.15, 0.75)
    pure = np.clip(np.abs((hue + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0, 1)
    colour = most * (1 - rng.uniform(*saturation) * (1 - pure))
    return float(colour[0]), float(colour[1]), float(colour[2])


def scaled(colour: Triple, factor: float) -> Triple:
    """Darken or lighten a linear colour, kept below 0.95."""
    r, g, b = (min(0.95, channel * factor) for channel in colour)
    return r, g, b


def _roughness(texture: Texture, rng: Rng) -> Plane | float:
    if "roughness" not in texture.maps:
        return float(rng.uniform(0.3, 0.8))
    return np.asarray(np.clip(read_map(texture.maps["roughness"]) @ GREY, 0.05, 1.0), np.float32)


def _metallic(texture: Texture) -> Plane | float:
    if "metallic" in texture.maps:
        grey: Plane = read_map(texture.maps["metallic"]) @ GREY
        return grey
    return texture.metallic or 0.0
