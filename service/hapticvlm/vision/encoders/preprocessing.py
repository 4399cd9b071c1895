"""Reads a network's own preprocessing and applies it to crops.

It is read from preprocessor_config.json. A crop is square already, so the steps that remain are
resizing it, cutting a square out of its middle, and the scale, mean and deviation of its colours.
Steps that are not implemented here are refused, never skipped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hapticvlm.vision.encoders.encoder import Floats, Pixels

Colour = tuple[float, float, float]
PREPROCESSING = ("preprocessor_config.json", "processor_config.json")
LARGEST_PX = 2048
CONVNEXT_SHARE = 224 / 256  # crop_pct where a ConvNeXt's file does not state it
CONVNEXT_WHOLE_PX = 384  # from this size on ConvNeXt's processor does not crop
UNSUPPORTED = ("do_flip_channel_order", "do_grayscale", "rescale_offset", "include_top")


@dataclass(frozen=True, slots=True)
class Preprocessing:
    """The steps from a crop to a network's input.

    side: of the crop, px. input_side: of the square in its middle that the network takes, px. A
    channel's value is (level * scale - mean) / deviation, of levels 0..255.
    """

    side: int
    input_side: int
    scale: float
    mean: Colour
    deviation: Colour

    def apply(self, pixels: Pixels) -> tuple[Floats, Floats]:
        """Map (N, S, S, 4) uint8 RGB and mask to (N, 3, I, I) float32 and mask (N, I, I) 0..1."""
        # A crop has the side that comes before the network's own central crop, which is done here.
        # So the object appears as large as the network was trained to see it.
        edge = (self.side - self.input_side) // 2
        inner = slice(edge, edge + self.input_side)
        square = pixels[:, inner, inner]
        levels = square[..., :3].astype(np.float32) * np.float32(self.scale)
        images = (levels - np.array(self.mean, np.float32)) / np.array(self.deviation, np.float32)
        masks = (square[..., 3] > 0).astype(np.float32)
        return np.ascontiguousarray(images.transpose(0, 3, 1, 2)), masks


def read_preprocessing(fields: Mapping[str, Any]) -> Preprocessing:
    """Read the content of a preprocessor_config.json. Raises ValueError with the reason."""
    refused = [name for name in UNSUPPORTED if fields.get(name)]
    if refused:
        raise ValueError(f"it asks for {', '.join(refused)}, which is not supported")
    side, input_side = _sides(fields)
    if not 1 <= input_side <= side <= LARGEST_PX:
        raise ValueError(f"{input_side} px of {side} px: sizes must be 1 to {LARGEST_PX}")
    scale = float(fields.get("rescale_factor", 1 / 255)) if fields.get("do_rescale", True) else 1.0
    if not fields.get("do_normalize", True):
        return Preprocessing(side, input_side, scale, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    mean = _colour(fields, "image_mean")
    deviation = _colour(fields, "image_std")
    if not min(deviation) > 0.0:
        raise ValueError(f"image_std is {deviation}: each must be above 0")
    return Preprocessing(side, input_side, scale, mean, deviation)


def _sides(fields: Mapping[str, Any]) -> tuple[int, int]:
    """Return the side of the crop and of the square that the network takes, px."""
    if not fields.get("do_resize", True) or "size" not in fields:
        side = _side(fields, "crop_size")
        return side, side
    side = _side(fields, "size")
    if fields.get("do_center_crop"):
        return side, _side(fields, "crop_size")
    kind = fields.get("image_processor_type") or fields.get("feature_extractor_type") or ""
    is_convnext = str(kind).startswith("ConvNext") or "crop_pct" in fields
    if not is_convnext or side >= CONVNEXT_WHOLE_PX:
        return side, side
    return int(side / (fields.get("crop_pct") or CONVNEXT_SHARE)), side


def _side(fields: Mapping[str, Any], name: str) -> int:
    """Read a size written as a number, a shortest edge, or equal height and width."""
    size = fields.get(name)
    if isinstance(size, Mapping):
        edges = {size.get(key) for key in ("shortest_edge", "height", "width") if key in size}
        size = edges.pop() if len(edges) == 1 else None
    if type(size) is not int:
        raise ValueError(f"{name} is {fields.get(name)!r}: one side in px is needed")
    return size


def _colour(fields: Mapping[str, Any], name: str) -> Colour:
    values = fields.get(name)
    if not isinstance(values, list | tuple) or len(values) != 3:
        raise ValueError(f"{name} is {values!r}: three numbers are needed")
    red, green, blue = (float(value) for value in values)
    return red, green, blue
