"""Tells pictures of flat colours, as low-poly games draw them, from photographs and rooms. Pure.

The encoder learned materials from photographs and from renders with textures. A thing in flat
colours has no grain to recognise, and the encoder is then often sure and wrong. Such pictures are
told by a count: in most places inside the mask, a pixel has the same colour as its neighbour. A
gallery has a scale of its own for them (galleries/gallery.py), and the references of their scene
count more (scene_references.py).

Pure white and black are left out of the count. They are the ground of cut-out product photographs,
and the ends of a camera's range; neither is the colour of a game's thing.
"""

from __future__ import annotations

import numpy as np

from hapticvlm.vision.pictures import Crop

# Our choice, looked at on game kits and on choose_web. Colours are sums of red, green and blue.
SAME = 1  # neighbours that differ by this or less have the same colour
WHITE = 738
BLACK = 24
FLAT_SHARE = 0.5  # of the neighbours, above which a picture is flat
LEAST = 50  # neighbours that a share is taken of
EVERY = 4  # which rows are counted: a quarter of them gives the same answer


def is_flat(crop: Crop) -> bool:
    """Return whether most neighbouring pixels inside the mask have the same colour."""
    rows = crop.image[::EVERY]
    inside = crop.mask[::EVERY] > 0
    levels = rows[..., 0].astype(np.int16) + rows[..., 1] + rows[..., 2]
    left = levels[:, :-1]
    right = levels[:, 1:]
    # A pixel that is not pure white, beside one that is, is an edge and counts.
    is_ground = ((left >= WHITE) & (right >= WHITE)) | ((left <= BLACK) & (right <= BLACK))
    counted = inside[:, :-1] & inside[:, 1:] & ~is_ground
    count = int(np.count_nonzero(counted))
    same = int(np.count_nonzero(counted & (np.abs(left - right) <= SAME)))
    return count >= LEAST and same > FLAT_SHARE * count
