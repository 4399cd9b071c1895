"""A data folder in small, for rooms to be drawn from."""

from pathlib import Path

import numpy as np
from PIL import Image

from hapticvlm_lab.training.rooms import page

TEACHES, HELD_BACK = "Some005", "Some004"  # by sources.is_tile_held_back
SKY_HELD_BACK = "forest_slope"


def write_data(folder: Path) -> Path:
    """A data folder in small: two tiles a folder and two skies, one of each held back."""
    rng = np.random.default_rng(1)
    for number, name in enumerate(page.FOLDERS.split()[1:]):
        (folder / "ambientcg_tiles" / name).mkdir(parents=True)
        for asset in (TEACHES, HELD_BACK):
            tone = 40 + 180 * rng.random(3) + 20 * rng.random((32, 32, 1)) + number
            tile = Image.fromarray(tone.clip(0, 255).astype(np.uint8))
            tile.save(folder / "ambientcg_tiles" / name / f"{asset}.jpg")
    (folder / "hdri").mkdir()
    for name in ("open_field", SKY_HELD_BACK):
        header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n"
        sky = np.tile(np.array([130, 140, 160, 129], np.uint8), (16, 32, 1))
        (folder / "hdri" / f"{name}_512.hdr").write_bytes(header + sky.tobytes())
    return folder
