"""Writes crops of game kits as a headset shows them.

The objects of a kit stand in the rooms' scenes, each beside others of its kit, in rooms with
photographed or plainly coloured grounds. Masks are the objects' own. One file a kit, since kits are
left out whole: objects of one kit share a palette.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from hapticvlm_lab.training import sources
from hapticvlm_lab.training.rooms import Rooms, RoomsError, opened
from hapticvlm_lab.training.rooms.shards import cut, is_large, store
from hapticvlm_lab.training.sources import Prop

ROUNDS = 2  # of rooms in which each object is the subject of one view
SHOWN = 4  # objects of a room that are drawn
BESIDE = 3  # further objects of a room
SEEDS = 2**20  # of rooms

Pixels = NDArray[np.uint8]
Drawn = tuple[Pixels, Prop]  # (224, 224, 4) RGB and mask, and what it shows


def kits(data: Path, *, held_back: bool) -> list[str]:
    """List the kits that may teach, or those that are held back. Raises RoomsError."""
    try:
        every = sources.props(data)
    except FileNotFoundError as error:
        raise RoomsError(f"{error.filename} is missing: kits are read from DATA/kits") from error
    names = {prop.kit for prop in every}
    return sorted(name for name in names if (name in sources.KITS_HELD_BACK) == held_back)


def draw(data: Path, out: Path, names: Sequence[str]) -> None:
    """Write OUT/KIT.npz for the kits that have none yet. Raises RoomsError."""
    out.mkdir(parents=True, exist_ok=True)
    missing = [name for name in names if not (out / f"{name}.npz").exists()]
    every = sources.props(data)
    if not missing:
        return
    with opened(data, [data / sources.KITS / name for name in missing]) as rooms:
        for name in track(missing, "kits"):
            _write(rooms, [prop for prop in every if prop.kit == name], out / f"{name}.npz")


def plan(labels: Sequence[str], rng: np.random.Generator) -> Iterator[tuple[list[int], list[int]]]:
    """Yield for each room what it shows, each labelled object once, and what stands beside."""
    labelled = [at for at, label in enumerate(labels) if label != sources.UNKNOWN]
    order = rng.permutation(labelled).tolist()
    for start in range(0, len(order), SHOWN):
        shown = order[start : start + SHOWN]
        others = [at for at in range(len(labels)) if at not in shown]
        yield shown, rng.permutation(others)[:BESIDE].tolist()


def _crops(rooms: Rooms, props: Sequence[Prop], rng: np.random.Generator) -> Iterator[Drawn]:
    labels = [prop.label for prop in props]
    plans = itertools.chain.from_iterable(plan(labels, rng) for _ in range(ROUNDS))
    first = int(rng.integers(SEEDS))  # neighbouring seeds share their painted maps
    for seed, (shown, beside) in enumerate(plans, first):
        for picture in rooms.place(seed, shown, beside):
            if is_large(picture):
                yield cut(picture), props[shown[picture.id - 1]]


def _write(rooms: Rooms, props: Sequence[Prop], path: Path) -> None:
    """Write big, label and the object's path."""
    rooms.take([(prop.path, prop.label) for prop in props])
    rng = np.random.default_rng(crc32(path.stem.encode()))
    big, shown = zip(*_crops(rooms, props, rng), strict=True)
    labels, paths = zip(*((prop.label, prop.path) for prop in shown), strict=True)
    store(path, big=np.stack(big), label=labels, path=paths)
