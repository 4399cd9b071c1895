"""Cuts windows out of a texture map and reads the surface's material off them. Pure.

A texture map is the flat picture that an engine wraps around a surface, without light, outline or
surroundings. The encoder was taught whole objects, so a gallery has a linear layer for maps alone
(`Gallery.texture_layer`). It reads six windows of different places and sizes, because nobody states
how many centimetres of the surface a pixel covers, and the beliefs are averaged.

An atlas holds the maps of many things in one picture. Its windows show different materials, so no
belief in one material may follow from their mean. Embeddings of windows of one material lie close
together, and the less they do, the more is left open (galleries/gallery.py). Whoever knows which
part of the atlas a surface uses names it as the region.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import WHOLE, Frame
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder, Floats
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.pictures import Crop, Pixels

# Longest side that a map is shrunk to, px. Clients send no more, so a file read at the command line
# gives the same answer.
SIDE_PX = 256
LEAST_PX = 8  # shorter side of the region, below which there is no grain to read
# Windows: side as a share of the region's shorter side, and place, 0 the left or top end, 1 the
# other one.
WINDOWS = (
    (1.0, 0.5, 0.5),
    (0.6, 0.0, 0.0),
    (0.6, 1.0, 1.0),
    (0.6, 0.0, 1.0),
    (0.6, 1.0, 0.0),
    (0.4, 0.5, 0.5),
)


def read(
    frame: Frame,
    encoder: Encoder,
    gallery: Gallery,
    embed: Callable[[Sequence[Crop]], Floats] | None = None,
) -> Evidence:
    """Read the material of a map, or of the region of it that the frame names.

    Returns evidence without beliefs where the gallery has no layer for maps, or there is nothing
    to read. `embed` embeds in place of the encoder. Raises PictureError and EncoderError.
    """
    crops = windows(frame, encoder.side)
    if gallery.texture_layer is None or not crops:
        return Evidence("texture", ())
    return gallery.match_texture((embed or encoder.embed)(crops))


def windows(frame: Frame, side: int) -> list[Crop]:
    """Cut the windows of a map, each (side, side); none where there is nothing to read.

    That is a region of fewer than LEAST_PX pixels a side, and one of plain colours, as the palettes
    of low-poly games are: it has no grain. Raises PictureError.
    """
    pixels = _shrunk(frame)
    height, width = pixels.shape[:2]
    shorter = min(height, width)
    if shorter < LEAST_PX or is_flat(Crop(pixels, np.full((height, width), 255, np.uint8))):
        return []
    inside = np.full((side, side), 255, np.uint8)
    crops = []
    for share, x, y in WINDOWS:
        length = max(1, round(shorter * share))
        left = round((width - length) * x)
        top = round((height - length) * y)
        box = (float(left), float(top), float(left + length), float(top + length))
        crops.append(Crop(pictures.resize(pixels, box, side), inside))
    return crops


def _shrunk(frame: Frame) -> Pixels:
    """Decode the region of a map, upright, and shrink it to SIDE_PX: (H, W, 3)."""
    from PIL import Image

    pixels = pictures.cut_region(frame, frame.region or WHOLE, SIDE_PX)
    image = Image.fromarray(np.ascontiguousarray(pixels))
    image.thumbnail((SIDE_PX, SIDE_PX), Image.Resampling.BILINEAR)
    return np.asarray(image)
