"""Contact sheets: pictures side by side, to be looked at."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def save_sheet(images: Sequence[NDArray[np.uint8]], columns: int, path: Path) -> None:
    """Write pictures of one size (S, S, 3) as a grid, row by row."""
    side = images[0].shape[0]
    rows = -(-len(images) // columns)
    sheet = np.zeros((rows * side, columns * side, 3), np.uint8)
    for number, image in enumerate(images):
        y, x = number // columns * side, number % columns * side
        sheet[y : y + side, x : x + side] = image
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(sheet).save(path)
