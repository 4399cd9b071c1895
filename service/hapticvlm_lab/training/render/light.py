"""What shines from all around: photographed skies (HDRI) and made-up rooms, blurred for roughness.

A surrounding is a picture over all directions (longitude across, polar angle down). Rough surfaces
see it blurred, dull ones its irradiance, so all of these are kept in one table of rows: the
picture, ever blurrier ones, then irradiance / pi. Knows no bodies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training import sources
from hapticvlm_lab.training.render.lookup import bordered, corners, weighed
from hapticvlm_lab.training.render.noise import mix
from hapticvlm_lab.training.render.radiance import read_radiance

SHARP = (256, 512)  # px of a surrounding, down and across
_BLURRED = (64, 128)
_DULL = (16, 32)
_BLURS = (1.2, 2.5, 5.0, 10.0, 20.0)  # px at 64 x 128, each on top of the one before
_LEVELS = 1 + len(_BLURS)


def _rows(size: tuple[int, int]) -> int:
    return (size[0] + 2) * (size[1] + 2)


_FIRST = _rows(SHARP)  # row of the first blurred level
_LAST = _FIRST + _LEVELS * _rows(_BLURRED)  # row of the irradiance
_ROWS = _LAST + _rows(_DULL)
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
        level = roughness.clamp(0, 1) * (_LEVELS - 0.01)
        blurred = (level - 1).clamp(min=0)
        low = blurred.long()
        share = (blurred - low)[:, None]
        chart = _chart(direction)
        near, weight = _around(chart, _BLURRED)
        near = near + (which * _ROWS + _FIRST + low * _rows(_BLURRED))[:, None]
        index = torch.cat([near, near + _rows(_BLURRED)], 1)
        seen = weighed(self.rows, index, torch.cat([weight * (1 - share), weight * share], 1))
        shiny = (level < 1).nonzero()[:, 0]
        if len(shiny):
            clear = self._sharp(which[shiny], chart[:, shiny])
            seen[:, shiny] = mix(clear, seen[:, shiny], level[shiny])
        return seen

    def sharp(self, which: Tensor, direction: Tensor) -> Tensor:
        """Radiance from directions (3, P), unblurred: (3, P)."""
        return self._sharp(which, _chart(direction))

    def irradiance(self, which: Tensor, normal: Tensor) -> Tensor:
        """Irradiance / pi on surfaces of these normals (3, P): (3, P)."""
        index, weight = _around(_chart(normal), _DULL)
        return weighed(self.rows, index + (which * _ROWS + _LAST)[:, None], weight)

    def _sharp(self, which: Tensor, chart: Tensor) -> Tensor:
        index, weight = _around(chart, SHARP)
        return weighed(self.rows, index + (which * _ROWS)[:, None], weight)


def load_lights(data: Path) -> Lights:
    """Read the surroundings under data/hdri that are not held back."""
    paths = [
        path
        for path in sorted((data / "hdri").glob("*_512.hdr"))
        if path.name.removesuffix("_512.hdr") not in sources.HDRI_HELD_BACK
    ]
    pictures = [torch.from_numpy(read_radiance(path)).permute(2, 0, 1) for path in paths]
    sized = [functional.interpolate(p[None], SHARP, mode="area")[0] for p in pictures]
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
    blurred = [functional.interpolate(picture[None], _BLURRED, mode="area")[0]]
    for deviation in _BLURS:
        blurred.append(_blurred(blurred[-1], deviation))
    dull = _irradiance(blurred[2])
    levels = [picture, *blurred, dull]
    return torch.cat([bordered(level[None], wraps=True)[0] for level in levels])


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


def _around(chart: Tensor, size: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """Find the four rows around chart places (2, P) of a level: index and weight (P, 4)."""
    height, width = size
    return corners(chart[0] * width - 0.5, chart[1] * height - 0.5, width + 2)
