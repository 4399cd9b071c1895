"""What a material encoder must beat: colours, textures, nothing learned.

All are encoders like ours (crops in, unit embeddings out), so that every method goes through the
same protocol.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.bench.material.texture import LENGTH, describe

Floats = NDArray[np.float32]

CLIP = 4.0  # standard deviations


@dataclass(frozen=True, slots=True)
class ColourHistogram:
    """Root of the 4 x 4 x 4 histogram of the colours under the mask."""

    side: int
    name: str = "colour histogram"
    dimension: int = 64

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, 64) float32, each of unit norm."""
        return np.stack([_histogram(crop) for crop in crops])


@dataclass(frozen=True, slots=True)
class TextureStatistics:
    """`texture.describe`, standardised by the centre and scale (F,) of some pictures."""

    side: int
    centre: Floats
    scale: Floats
    name: str = "texture statistics"
    dimension: int = LENGTH

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, F) float32, each of unit norm."""
        raw = (np.stack([describe(crop) for crop in crops]) - self.centre) / self.scale
        return _unit(np.clip(raw, -CLIP, CLIP))


def standardised_on(crops: Sequence[Crop], side: int) -> TextureStatistics:
    """Texture statistics as wide as these crops make them; takes no label."""
    found = np.stack([describe(crop) for crop in crops])
    return TextureStatistics(side, found.mean(axis=0), found.std(axis=0) + np.float32(1e-4))


def _histogram(crop: Crop) -> Floats:
    inside = crop.image[crop.mask > 0] if crop.mask.any() else crop.image.reshape(-1, 3)
    counts = np.bincount((inside // 64).astype(int) @ np.array((16, 4, 1)), minlength=64)
    roots: Floats = np.sqrt(counts / counts.sum()).astype(np.float32)
    return roots


def _unit(rows: Floats) -> Floats:
    norms = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(rows / np.maximum(norms, np.float32(1e-6)), np.float32)
