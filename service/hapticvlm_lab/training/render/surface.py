"""What a sample of a material is to light: its maps and its finish; many of them as one bank.

Knows neither shapes nor lights. A bank keeps every map with its halvings (mip levels) in one table
of rows, so that any texel of any material is one row: (R, CHANNELS) float32.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training.render.lookup import bordered, corners, weighed
from hapticvlm_lab.training.render.noise import SIDE, shifted

LEVELS = 5  # mip levels: 256, 128, 64, 32, 16 texels
CHANNELS = 8  # red, green, blue, slope along x and y, roughness, metalness, cavity
_SIDES = tuple(SIDE >> level for level in range(LEVELS))
_STARTS = tuple(sum((side + 2) ** 2 for side in _SIDES[:level]) for level in range(LEVELS))
ROWS = sum((side + 2) ** 2 for side in _SIDES)  # rows of one material


@dataclass(frozen=True, slots=True)
class Finish:
    """The parts of a material that are the same all over; shares are 0 to 1.

    wrap: how far light reaches around the terminator; reflectance: at normal incidence;
    tint: colour (3,) of light let through; thin: a sheet or wall rather than a solid body.
    """

    coat: float = 0.0
    coat_roughness: float = 0.1
    sheen: float = 0.0
    anisotropy: float = 0.0
    reflectance: float = 0.04
    wrap: float = 0.0
    transmission: float = 0.0
    thin: float = 0.0
    frost: float = 0.0
    ior: float = 1.5
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    sheen_colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Surface:
    """One sample: albedo (3, SIDE, SIDE) linear; height, roughness, metalness (SIDE, SIDE).

    `bump` scales the slope of the height (per texel) into the slope of the normal.
    """

    albedo: Tensor
    height: Tensor
    roughness: Tensor
    bump: float = 0.3
    metalness: Tensor | float = 0.0
    finish: Finish = field(default_factory=Finish)


@dataclass(frozen=True, slots=True)
class Bank:
    """Samples side by side: rows (M * ROWS, CHANNELS), finish columns of (M,) each."""

    rows: Tensor
    finish: dict[str, Tensor]
    mean: Tensor  # (M, 3) mean albedo

    def texels(self, material: Tensor, uv: Tensor, level: Tensor) -> Tensor:
        """Look materials up: material (P,) int64, uv (2, P), level (P,) -> (CHANNELS, P).

        Bilinear in the nearest level; maps are mirrored at their edges, 1 in uv is one map.
        """
        nearest = (level + 0.5).clamp(0, LEVELS - 1).long()
        side = torch.tensor(_SIDES, device=uv.device)[nearest]
        folded = (uv.remainder(2.0) - 1).abs() * side - 0.5
        index, weight = corners(folded[0], folded[1], side + 2)
        start = material * ROWS + torch.tensor(_STARTS, device=uv.device)[nearest]
        return weighed(self.rows, index + start[:, None], weight)

    def of(self, name: str, material: Tensor) -> Tensor:
        """Return a finish column per point: (P,), or (3, P) for colours."""
        column = self.finish[name]
        return column[material] if column.dim() == 1 else column[material].T

    def uses(self, name: str) -> bool:
        """Whether any sample has more than none of it."""
        return bool((self.finish[name] > 0).any())


def bank(surfaces: Sequence[Surface]) -> Bank:
    """Put samples into one bank, in their order."""
    maps = torch.stack([_channels(surface) for surface in surfaces])
    levels, current = [], maps
    for _ in range(LEVELS):
        levels.append(bordered(current))
        current = functional.avg_pool2d(current, 2)
    rows = torch.cat(levels, 1).reshape(-1, CHANNELS).contiguous()
    names = Finish.__slots__
    columns = {
        name: torch.tensor([getattr(surface.finish, name) for surface in surfaces]).to(rows)
        for name in names
    }
    return Bank(rows, columns, maps[:, :3].mean((2, 3)))


def _channels(surface: Surface) -> Tensor:
    """Stack the maps, colours and roughness in bounds: (CHANNELS, SIDE, SIDE)."""
    height = surface.height * surface.bump
    right = functional.pad(height[:, 1:] - height[:, :-1], (0, 1))
    down = functional.pad(height[1:] - height[:-1], (0, 0, 0, 1))
    cavity = shifted(height, 8)
    rough = surface.roughness.clamp(0.03, 1)
    metal = torch.as_tensor(surface.metalness, device=height.device).expand_as(height)
    fields = torch.stack([right, down, rough, metal, cavity])
    return torch.cat([surface.albedo.clamp(0.005, 0.98).expand(3, SIDE, SIDE), fields])
