"""Writes shards of path-traced crops, unlike the rooms': `python -m hapticvlm_lab.training.traced`.

The generator of the held-back set draws other objects (other seeds) with textures and skies that
are not held back, and no model. A network that learned from these still meets unseen objects,
textures and lights in the held-back set, but no longer an unseen renderer.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from hapticvlm import materials, messages
from hapticvlm.vision import pictures
from hapticvlm_lab.training.held_back import develop, renderer
from hapticvlm_lab.training.held_back.cameras import Camera
from hapticvlm_lab.training.held_back.catalogue import Catalogue, read_catalogue
from hapticvlm_lab.training.held_back.plan import MAIN, Plan
from hapticvlm_lab.training.held_back.shapes import COMMON
from hapticvlm_lab.training.held_back.stage import seed_of, set_stage

# px: of a crop, of a picture
SIDE = 224
PICTURE = 112
SAMPLES = 2  # a film pixel and half
OBJECTS_A_SHARD = 25
TURNS = 3  # of the four views of an approach
TURN = 0.5  # rad, most
LEAST = 0.05  # share of its picture that an object must fill
SOURCE = "traced"
CLASSES = (*MAIN, *materials.MATERIALS, materials.UNKNOWN)  # in turn: the main ones twice


def main() -> int:
    """Read the command line and render; existing shards are left as they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--first", type=int, default=0, help="number of the first shard")
    parser.add_argument("--shards", type=int, required=True, help=f"{OBJECTS_A_SHARD} objects each")
    chosen = parser.parse_args()
    draw(chosen.data, chosen.out, range(chosen.first, chosen.first + chosen.shards))
    return 0


def draw(data: Path, out: Path, numbers: range) -> None:
    """Write the shards that do not exist yet."""
    out.mkdir(parents=True, exist_ok=True)
    paths = [(number, out / f"shard_{number:05d}.npz") for number in numbers]
    missing = [(number, path) for number, path in paths if not path.exists()]
    if not missing:
        return
    catalogue = read_catalogue(data, teaches=True)
    sys.stderr.write(f"Mitsuba {renderer.start()}\n")
    for number, path in missing:
        _write(path, number, catalogue)


def plan(number: int) -> Plan:
    """Choose class and shape of an object."""
    truth = CLASSES[number % len(CLASSES)]
    turn = number // len(CLASSES)
    shape = COMMON[(3 * number + turn) % len(COMMON)]
    leaves = truth == "foliage" and turn % 2 == 0
    return Plan(
        f"{SOURCE}_{number}", truth, turn, "leaves" if leaves else shape, is_model=False, own=False
    )


def views(cameras: Sequence[Camera], rng: np.random.Generator) -> tuple[Camera, ...]:
    """Turn each camera TURNS times round its target."""
    return tuple(
        _turned(camera, float(angle))
        for camera in cameras
        for angle in rng.uniform(-TURN, TURN, TURNS)
    )


def _turned(camera: Camera, angle: float) -> Camera:
    x, y, z = camera.eye - camera.target
    cosine = np.cos(angle)
    sine = np.sin(angle)
    turned = np.array([cosine * x + sine * z, y, cosine * z - sine * x])
    return replace(camera, eye=camera.target + turned)


def _write(path: Path, number: int, catalogue: Catalogue) -> None:
    """Write big (N, 224, 224, 4) RGB and mask, label, source."""
    numbers = range(number * OBJECTS_A_SHARD, (number + 1) * OBJECTS_A_SHARD)
    big = list[NDArray[np.uint8]]()
    labels = list[str]()
    for thing in track([plan(number) for number in numbers], path.stem):
        crops = _crops(thing, catalogue)
        big += crops
        labels += [thing.truth] * len(crops)
    order = np.random.default_rng(number).permutation(len(big))
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        named = np.array(labels)[order]
        np.savez(file, big=np.stack(big)[order], label=named, source=[SOURCE] * len(named))
    part.replace(path)


def _crops(thing: Plan, catalogue: Catalogue) -> list[NDArray[np.uint8]]:
    """Render an object from all sides and cut it as the service does."""
    seed = seed_of(thing.object_id)
    rng = np.random.default_rng([seed, TURNS])
    stage = set_stage(thing, catalogue, circling=False)
    stage = replace(stage, cameras=views(stage.cameras, rng))
    halves, masks = renderer.render(stage, PICTURE, SAMPLES, seed)
    shown = develop.develop(halves, masks, rng)
    large = [index for index, mask in enumerate(masks) if (mask >= 0.5).mean() >= LEAST]
    return [_cut(shown[index], develop.mask_png(masks[index])) for index in large]


def _cut(picture: NDArray[np.uint8], mask: bytes) -> NDArray[np.uint8]:
    frame = messages.Frame(
        id=1, captured_at=0.0, format="rgb8", width=PICTURE, height=PICTURE,
        origin="top", image=picture.tobytes(), mask=mask,
    )  # fmt: skip
    crop = pictures.crop(frame, SIDE)
    return np.dstack([crop.image, crop.mask])


if __name__ == "__main__":
    sys.exit(main())
