"""Writes shards of crops, or a contact sheet: `python -m hapticvlm_lab.training.rooms`."""

from __future__ import annotations

import argparse
import io
import itertools
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from rich.progress import track

from hapticvlm import messages
from hapticvlm.vision import pictures
from hapticvlm_lab.training.rooms.page import Picture, Rooms, RoomsError, opened

SIDE = 224
PER_SHARD = 500
ROOMS_A_SHARD = 50  # seeds set aside for each shard, so that any may be drawn alone
SHARDS_A_PAGE = 10  # then the browser is restarted: it keeps some memory of every room
LEAST = 0.05  # share of its crop that a thing must fill
COLUMNS = 14  # of a sheet

# (224, 224, 4) RGB and mask, label, and height and width in px before it was scaled to SIDE
Crop = tuple[NDArray[np.uint8], str, tuple[int, ...]]


def main() -> int:
    """Read the command line and draw; existing shards are left as they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with tiles and skies")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--first", type=int, default=0, help="number of the first shard or room")
    parser.add_argument("--shards", type=int, default=0, help=f"of {PER_SHARD} crops each")
    parser.add_argument("--sheet", type=int, default=0, help="a contact sheet of so many crops")
    chosen = parser.parse_args()
    try:
        draw(chosen.data, chosen.out, range(chosen.first, chosen.first + chosen.shards))
        if chosen.sheet:
            with opened(chosen.data) as rooms:
                _sheet(rooms, chosen.sheet, chosen.first, chosen.out / "sheet.png")
    except RoomsError as error:
        sys.stderr.write(f"rooms: {error}\n")
        return 2
    return 0


def draw(data: Path, out: Path, numbers: range) -> None:
    """Write the shards that do not exist yet. Raises RoomsError."""
    out.mkdir(parents=True, exist_ok=True)
    missing = [number for number in numbers if not _path(out, number).exists()]
    for start in range(0, len(missing), SHARDS_A_PAGE):
        with opened(data) as rooms:
            for number in track(missing[start : start + SHARDS_A_PAGE], "shards of rooms"):
                _shard(rooms, number, _path(out, number))


def cut(picture: Picture) -> NDArray[np.uint8]:
    """Cut the first thing of a picture as the service does: (224, 224, 4), RGB and mask."""
    inside = picture.ids == picture.things[0].id
    mask = io.BytesIO()
    Image.fromarray(np.where(inside, 255, 0).astype(np.uint8)).save(mask, "PNG", compress_level=0)
    frame = messages.Frame(
        id=1, captured_at=0.0, format="rgb8", width=inside.shape[1], height=inside.shape[0],
        origin="top", image=picture.pixels.tobytes(), mask=mask.getvalue(),
    )  # fmt: skip
    crop = pictures.crop(frame, SIDE)
    return np.dstack([crop.image, crop.mask])


def _path(out: Path, number: int) -> Path:
    return out / f"shard_{number:05d}.npz"


def _crops(rooms: Rooms, seeds: Iterable[int], most: int) -> Iterator[Crop]:
    pictures = (picture for seed in seeds for picture in rooms.crops(seed))
    large = (p for p in pictures if p.things and (p.ids == p.things[0].id).mean() >= LEAST)
    for picture in itertools.islice(large, most):
        yield cut(picture), picture.things[0].label, picture.ids.shape


def _shard(rooms: Rooms, number: int, path: Path) -> None:
    """Write a shard: big (N, 224, 224, 4) RGB and mask, label, source, size (N, 2) in px."""
    seeds = range(number * ROOMS_A_SHARD, (number + 1) * ROOMS_A_SHARD)
    crops = list(_crops(rooms, seeds, PER_SHARD))
    order = np.random.default_rng(number).permutation(len(crops))
    big, labels, sizes = zip(*(crops[index] for index in order), strict=True)
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(
            file, big=np.stack(big), label=labels, source=["rooms"] * len(crops), size=sizes
        )  # fmt: skip
    part.replace(path)


def _sheet(rooms: Rooms, count: int, first: int, path: Path) -> None:
    """Write the first crops of each label in a row of its own."""
    rows: dict[str, list[NDArray[np.uint8]]] = {}
    for crop, label, _ in _crops(rooms, itertools.count(first), count):
        rows.setdefault(label, []).append(crop[..., :3])
    sheet = Image.new("RGB", (COLUMNS * SIDE, len(rows) * SIDE))
    for row, (label, crops) in enumerate(sorted(rows.items())):
        for column, crop in enumerate(crops[:COLUMNS]):
            sheet.paste(Image.fromarray(crop), (column * SIDE, row * SIDE))
        ImageDraw.Draw(sheet).text((4, row * SIDE + 4), f"{label} ({len(crops)})", fill="magenta")
    sheet.save(path)


if __name__ == "__main__":
    sys.exit(main())
