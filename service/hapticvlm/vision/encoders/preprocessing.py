"""What a network of transformers wants done to a crop, read from its own preprocessor_config.json.

A crop arrives square, so of the usual steps there remain: its side, the square cut out of its
middle, and the scale, mean and deviation of its colours. Steps that are not done here are refused,
never skipped. Resizing is the crop's own (bilinear). numpy only; knows no network.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Pixels = NDArray[np.uint8]
Colour = tuple[float, float, float]

LARGEST_PX = 2048
CONVNEXT_SHARE = 224 / 256  # crop_pct where a ConvNeXt's file has none
CONVNEXT_WHOLE_PX = 384  # from this size on ConvNeXt's processor cuts nothing off
NOT_DONE = ("do_flip_channel_order", "do_grayscale", "rescale_offset", "include_top")


@dataclass(frozen=True, slots=True)
class Preprocessing:
    """side: of the crop; input_side: of the square from its middle that the network sees; px.

    A channel's value is (level * scale - mean) / deviation, of levels 0..255.
    """

    side: int
    input_side: int
    scale: float
    mean: Colour
    deviation: Colour

    def apply(self, pixels: Pixels) -> tuple[Floats, Floats]:
        """Map (N, S, S, 4) uint8 RGB and mask to (N, 3, I, I) float32 and mask (N, I, I) 0..1."""
        # Crops are cut at the side before a network's own central crop. So the object's
        # surroundings that it would throw away are thrown away here, too, and the object appears as
        # large as the network has learned it.
        edge = (self.side - self.input_side) // 2
        inner = slice(edge, edge + self.input_side)
        square = pixels[:, inner, inner]
        levels = square[..., :3].astype(np.float32) * np.float32(self.scale)
        images = (levels - np.array(self.mean, np.float32)) / np.array(self.deviation, np.float32)
        masks = (square[..., 3] > 0).astype(np.float32)
        return np.ascontiguousarray(images.transpose(0, 3, 1, 2)), masks


def read_preprocessing(given: Mapping[str, Any]) -> Preprocessing:
    """Read the content of a preprocessor_config.json. Raises ValueError saying what is wrong."""
    refused = [name for name in NOT_DONE if given.get(name)]
    if refused:
        raise ValueError(f"it wants {', '.join(refused)}, which is not done here")
    side, input_side = _sides(given)
    if not 1 <= input_side <= side <= LARGEST_PX:
        raise ValueError(f"{input_side} px out of {side} px: sizes go from 1 to {LARGEST_PX}")
    scale = float(given.get("rescale_factor", 1 / 255)) if given.get("do_rescale", True) else 1.0
    if not given.get("do_normalize", True):
        return Preprocessing(side, input_side, scale, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    mean = _colour(given, "image_mean")
    deviation = _colour(given, "image_std")
    if not min(deviation) > 0.0:
        raise ValueError(f"image_std is {deviation}: each must be above 0")
    return Preprocessing(side, input_side, scale, mean, deviation)


def _sides(given: Mapping[str, Any]) -> tuple[int, int]:
    """Side of the crop and of the square the network sees, px."""
    if not given.get("do_resize", True) or "size" not in given:
        side = _side(given, "crop_size")
        return side, side
    side = _side(given, "size")
    if given.get("do_center_crop"):
        return side, _side(given, "crop_size")
    kind = given.get("image_processor_type") or given.get("feature_extractor_type") or ""
    is_convnext = str(kind).startswith("ConvNext") or "crop_pct" in given
    if not is_convnext or side >= CONVNEXT_WHOLE_PX:
        return side, side
    return int(side / (given.get("crop_pct") or CONVNEXT_SHARE)), side


def _side(given: Mapping[str, Any], name: str) -> int:
    """Read a size written as a number, a shortest edge, or equal height and width."""
    size = given.get(name)
    if isinstance(size, Mapping):
        edges = {size.get(key) for key in ("shortest_edge", "height", "width") if key in size}
        size = edges.pop() if len(edges) == 1 else None
    if type(size) is not int:
        raise ValueError(f"{name} is {given.get(name)!r}: one side in px is needed")
    return size


def _colour(given: Mapping[str, Any], name: str) -> Colour:
    values = given.get(name)
    if not isinstance(values, list | tuple) or len(values) != 3:
        raise ValueError(f"{name} is {values!r}: three numbers are needed")
    red, green, blue = (float(value) for value in values)
    return red, green, blue
