"""What shines from all around: photographed skies (HDRI) and made-up rooms, blurred for roughness.

A surrounding is a picture over all directions (longitude across, polar angle down). Rough surfaces
see it blurred, dull ones its irradiance, so all of these are kept in one table of rows: levels 0 to
ROUGHEST are ever blurrier, the last is irradiance / pi. Knows no bodies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm.training import sources
from hapticvlm.training.render.radiance import read_radiance
from hapticvlm.training.render.surface import weighed

ROUGHEST = 6  # the level that roughness 1 sees
IRRADIANCE = 7
SIZES = ((256, 512), (64, 128), (64, 128), (64, 128), (32, 64), (16, 32), (16, 32), (16, 32))
_BLURS = (1.2, 2.5, 5.0, 10.0, 20.0)  # px at 64 x 128, each on top of the one before
_STARTS = tuple(sum(h * w for h, w in SIZES[:level]) for level in range(len(SIZES)))
_ROWS = sum(h * w for h, w in SIZES)
_BRIGHTEST = 200.0  # a photographed sun is cut here: it stands for itself as a direct light
_MEAN = 0.55  # mean radiance all surroundings are brought to


@dataclass(frozen=True, slots=True)
class Lights:
    """Photographed surroundings that may teach: names, and pictures (K, 3, 256, 512) float32."""

    names: tuple[str, ...]
    pictures: Tensor


@dataclass(frozen=True, slots=True)
class Sky:
    """Surroundings side by side, in one table (E * rows, 3)."""

    rows: Tensor

    def look(self, which: Tensor, direction: Tensor, roughness: Tensor) -> Tensor:
        """Radiance from directions (3, P) as a surface of roughness (P,) sees it: (3, P)."""
        level = roughness.clamp(0, 1) * (ROUGHEST - 0.001)
        low = level.long()
        share = level - low
        where = _chart(direction)
        near, weight = _around(where, low)
        far, other = _around(where, low + 1)
        index = torch.cat([near, far], 1) + (which * _ROWS)[:, None]
        weights = torch.cat([weight * (1 - share)[:, None], other * share[:, None]], 1)
        return weighed(self.rows, index, weights)

    def sharp(self, which: Tensor, direction: Tensor) -> Tensor:
        """Radiance from directions (3, P), unblurred: (3, P)."""
        return self._level(which, direction, 0)

    def irradiance(self, which: Tensor, normal: Tensor) -> Tensor:
        """Irradiance / pi on surfaces of these normals (3, P): (3, P)."""
        return self._level(which, normal, IRRADIANCE)

    def _level(self, which: Tensor, direction: Tensor, level: int) -> Tensor:
        index, weight = _around(_chart(direction), torch.full_like(which, level))
        return weighed(self.rows, index + (which * _ROWS)[:, None], weight)


def load_lights(data: Path) -> Lights:
    """Read the surroundings under data/hdri that are not held back."""
    paths = [
        path
        for path in sorted((data / "hdri").glob("*_512.hdr"))
        if path.name.removesuffix("_512.hdr") not in sources.HDRI_HELD_BACK
    ]
    pictures = [torch.from_numpy(read_radiance(path)).permute(2, 0, 1) for path in paths]
    sized = [functional.interpolate(p[None], SIZES[0], mode="area")[0] for p in pictures]
    names = tuple(path.name.removesuffix("_512.hdr") for path in paths)
    return Lights(names, torch.stack(sized).clamp(max=_BRIGHTEST))


def sky(pictures: Sequence[Tensor]) -> Sky:
    """Prepare surroundings, each (3, 256, 512), for being looked up."""
    return Sky(torch.cat([_prepared(picture) for picture in pictures]).contiguous())


def _prepared(picture: Tensor) -> Tensor:
    """All levels of one picture as rows (_ROWS, 3), brought to the same mean radiance."""
    height = picture.shape[1]
    polar = (torch.arange(height, device=picture.device) + 0.5) / height * math.pi
    weight = torch.sin(polar)[:, None]
    mean = (picture.mean(0) * weight).mean() / weight.mean()
    picture = picture / mean.clamp(min=1e-4) * _MEAN
    current = functional.interpolate(picture[None], SIZES[1], mode="area")[0]
    levels = [picture, current]
    for deviation in _BLURS:
        current = _blurred(current, deviation)
        levels.append(current)
    levels.append(_irradiance(levels[3]))
    resized = [
        functional.interpolate(level[None], size, mode="area")[0]
        for level, size in zip(levels, SIZES, strict=True)
    ]
    return torch.cat([level.reshape(3, -1).T for level in resized])


def _blurred(picture: Tensor, deviation: float) -> Tensor:
    """Blur by a Gaussian that wraps around in longitude; wide ones on a coarser picture."""
    coarse = max(1, int(deviation // 2))
    height, width = picture.shape[1:]
    small = functional.interpolate(
        picture[None], (max(4, height // coarse), max(8, width // coarse)), mode="area"
    )
    reach = min(math.ceil(2 * deviation / coarse), small.shape[3])
    steps = torch.arange(-reach, reach + 1, device=picture.device, dtype=torch.float32)
    kernel = torch.exp(-((steps * coarse / deviation) ** 2) / 2)
    kernel = kernel / kernel.sum()
    wide = functional.pad(small, (reach, reach, 0, 0), mode="circular").transpose(0, 1)
    wide = functional.conv2d(wide, kernel.view(1, 1, 1, -1))
    tall = functional.pad(wide, (0, 0, reach, reach), mode="replicate")
    tall = functional.conv2d(tall, kernel.view(1, 1, -1, 1)).transpose(0, 1)
    return functional.interpolate(tall, (height, width), mode="bilinear", align_corners=False)[0]


def _irradiance(picture: Tensor) -> Tensor:
    """Cosine-weighted mean over the hemisphere around each direction: (3, 16, 32)."""
    coarse = functional.interpolate(picture[None], (16, 32), mode="area")[0].reshape(3, -1)
    directions, area = _directions(16, 32, picture.device)
    cosine = (directions.T @ directions).clamp(min=0) * area
    return (coarse @ (cosine / cosine.sum(1, keepdim=True)).T).view(3, 16, 32)


def _directions(height: int, width: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """Directions (3, height * width) of a chart's pixels and the area each stands for."""
    polar = (torch.arange(height, device=device) + 0.5) / height * math.pi
    around = ((torch.arange(width, device=device) + 0.5) / width * 2 - 1) * math.pi
    flat = torch.sin(polar)[:, None].expand(height, width)
    up = torch.cos(polar)[:, None].expand(height, width)
    chart = torch.stack([flat * torch.cos(around), up, flat * torch.sin(around)])
    return chart.reshape(3, -1), flat.reshape(-1)


def _chart(direction: Tensor) -> Tensor:
    """Longitude and polar angle of directions (3, P), each 0 to 1: (2, P)."""
    across = torch.atan2(direction[2], direction[0]) / (2 * math.pi) + 0.5
    down = torch.acos(direction[1].clamp(-0.9999, 0.9999)) / math.pi
    return torch.stack([across, down])


def _around(where: Tensor, level: Tensor) -> tuple[Tensor, Tensor]:
    """Return the four rows around chart places (2, P) at levels (P,): index and weight (P, 4)."""
    sizes = torch.tensor(SIZES, device=where.device)
    starts = torch.tensor(_STARTS, device=where.device)[level]
    height, width = sizes[level, 0], sizes[level, 1]
    x, y = where[0] * width - 0.5, where[1] * height - 0.5
    left, top = x.floor(), y.floor()
    px, py = x - left, y - top
    x0 = left.long() % width
    x1 = (left.long() + 1) % width
    y0 = torch.minimum(top.long().clamp(min=0), height - 1)
    y1 = torch.minimum((top.long() + 1).clamp(min=0), height - 1)
    index = torch.stack([y0 * width + x0, y0 * width + x1, y1 * width + x0, y1 * width + x1], 1)
    weight = torch.stack([(1 - px) * (1 - py), px * (1 - py), (1 - px) * py, px * py], 1)
    return index + starts[:, None], weight
