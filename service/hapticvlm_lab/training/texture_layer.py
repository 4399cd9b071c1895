"""Fits the layer of texture maps.

A gallery reads texture maps (vision/textures.py) by a linear layer of their own. It is taught on
three quarters of the ambientCG tiles (CC0): the six windows of each, and three of random places,
turned, and changed in brightness and colour. The quarter that is held back teaches nothing.

The scale of the layer and the constants of agreement are chosen on the tiles of sources.CHOICE,
which other people painted and photographed: those under which the true materials are least
surprising, of four groups and of all, beside atlases laid out of the same tiles, in which no
material is true.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from hapticvlm.materials import UNKNOWN
from hapticvlm.messages import Frame
from hapticvlm.vision import textures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.files import read_frame
from hapticvlm.vision.galleries.gallery import Gallery, LinearLayer, agreement, softmax
from hapticvlm.vision.galleries.network_gallery import fit_layer
from hapticvlm.vision.galleries.storage import FILE_NAME, load_gallery, save_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.training import crops, sources
from hapticvlm_lab.training.describing import NAMES

SEED = 20261126
VARIED = 3  # further windows of a tile that teaches
PENALTY = 2e-4  # of the squared weights; chosen with the tiles of sources.CHOICE (LOG.md)
FEW = 0.125  # of the windows of the largest class, from which a class counts in full
SCALES: tuple[float, ...] = tuple(np.geomspace(0.5, 3.0, 24).tolist())
SLOPES = (20.0, 40.0, 80.0, 160.0, 320.0)
BARS: tuple[float, ...] = tuple(np.arange(0.8, 0.981, 0.01).tolist())
ATLAS_SIDES = (2, 3, 4)  # tiles a side
LEAST = 1e-4  # belief that the truth has at least
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Maps:
    """N maps: windows (N, W, D), and labels (N,), places in NAMES."""

    windows: Floats
    labels: Indices


def add_to(data: Path, _: Path, out: Path) -> str:
    """Add the layer to the gallery of the encoder in `out`; return a line on what was chosen."""
    encoder = load_encoder(str(out))
    gallery = load_gallery(out / FILE_NAME, encoder=encoder)
    layer = fit(_taught(encoder, data))
    paths = [*_maps(data, sources.CHOICE)]
    frames = ((read_frame(path), label) for path, label in track(paths, sources.CHOICE))
    choice, atlases = (_embedded(encoder, each) for each in (frames, _atlases(paths)))
    fitted = calibrate(replace(gallery, texture_layer=layer), choice, atlases)
    save_gallery(fitted, out / FILE_NAME)
    constants = fitted.calibration
    return (
        f"{encoder.name}: maps, scale {constants.texture:.2f}, agreement {constants.even:.3f} "
        f"with slope {constants.even_slope:.0f}"
    )


def fit(taught: Maps) -> LinearLayer:
    """Fit the layer: every class counts equally, but those of few windows less."""
    embeddings = taught.windows.reshape(-1, taught.windows.shape[-1])
    labels = np.repeat(taught.labels, taught.windows.shape[1])
    counts = np.bincount(labels, minlength=len(NAMES))
    weights = np.minimum(1.0, counts / (FEW * counts.max()))[labels] / counts[labels]
    # A row without weight of the last class, so that the layer has a column for each of NAMES.
    rows = np.concatenate([embeddings, np.zeros((1, embeddings.shape[1]), np.float32)])
    labels = np.append(labels, NAMES.index(UNKNOWN))
    return fit_layer(rows, labels, np.append(weights / weights.sum(), 0.0), PENALTY)


def calibrate(gallery: Gallery, choice: Maps, atlases: Maps) -> Gallery:
    """Choose scale and agreement on maps and atlases that taught nothing."""
    layer = gallery.texture_layer
    assert layer is not None
    shown = np.concatenate([choice.windows, atlases.windows])
    labels = np.concatenate([choice.labels, atlases.labels])
    logits = shown.astype(np.float64) @ layer.weights + layer.bias
    alike = np.array([agreement(windows) for windows in shown])
    is_atlas = labels == NAMES.index(UNKNOWN)
    counts = np.bincount(labels, minlength=len(NAMES))
    weights = np.where(is_atlas, 0.5, 0.5 / (np.count_nonzero(counts) - 1)) / counts[labels]

    def surprise(scale: float, slope: float, bar: float) -> float:
        one = 1.0 / (1.0 + np.exp(-slope * (alike - bar)))
        means = _means(scale * logits) * one[:, None]
        truth = np.where(is_atlas, 1.0 - one, means[np.arange(len(means)), labels])
        return -float(weights @ np.log(np.maximum(truth, LEAST)))

    trials = product(SCALES, SLOPES, BARS)
    scale, slope, bar = min(trials, key=lambda trial: surprise(*trial))
    constants = replace(gallery.calibration, texture=scale, even_slope=slope, even=bar)
    return replace(gallery, calibration=constants)


def _means(logits: Doubles) -> Doubles:
    """Turn logits (N, W, C) into mean beliefs (N, C)."""
    flat = softmax(logits.reshape(-1, logits.shape[-1]))
    return np.asarray(flat.reshape(logits.shape).mean(axis=1))


def _atlases(paths: Sequence[tuple[Path, str]]) -> Iterator[tuple[Frame, str]]:
    rng = np.random.default_rng(SEED)
    for number in track(range(min(120, 3 * len(paths))), "atlases"):
        side = ATLAS_SIDES[number % len(ATLAS_SIDES)]
        chosen = rng.choice(len(paths), side * side, replace=len(paths) < side * side)
        if len({paths[at][1] for at in chosen}) == 1:
            continue
        edge = textures.SIDE_PX // side
        atlas = Image.new("RGB", (edge * side, edge * side))
        for place, at in enumerate(chosen):
            with Image.open(paths[at][0]) as tile:
                part = tile.convert("RGB").resize((edge, edge), Image.Resampling.BILINEAR)
            atlas.paste(part, (place % side * edge, place // side * edge))
        yield _frame(atlas), UNKNOWN


def _taught(encoder: Encoder, data: Path) -> Maps:
    """Embed the tiles that teach: their windows, and as many varied ones."""
    rng = np.random.default_rng(SEED)
    rows = []
    labels = []
    for path, label in track([*_tiles(data)], "taught"):
        with Image.open(path) as image:
            tile = image.convert("RGB")
        windows = textures.windows(_frame(tile), encoder.side)
        if not windows:
            continue
        windows += [_varied(tile, encoder.side, rng) for _ in range(VARIED)]
        rows.append(encoder.embed(windows))
        labels.append(NAMES.index(label))
    return Maps(np.stack(rows), np.array(labels))


def _varied(tile: Image.Image, side: int, rng: np.random.Generator) -> Crop:
    """Cut a random window, turn it, and change its brightness and colour."""
    length = max(1, round(min(tile.size) * rng.uniform(0.35, 1.0)))
    left, top = (int(rng.integers(edge - length + 1)) for edge in tile.size)
    box = (left, top, left + length, top + length)
    cut = tile.resize((side, side), Image.Resampling.BILINEAR, box=box)
    pixels = np.rot90(np.asarray(cut), int(rng.integers(4))).astype(np.float32) / 255.0
    if rng.random() < 0.5:
        pixels = pixels[:, ::-1]
    tint = rng.uniform(0.85, 1.15, 3) * rng.uniform(0.75, 1.2)
    changed = np.clip(pixels ** rng.uniform(0.6, 1.6) * tint, 0.0, 1.0)
    whole = np.full((side, side), 255, np.uint8)
    return Crop(np.ascontiguousarray(changed * 255.0).astype(np.uint8), whole)


def _embedded(encoder: Encoder, frames: Iterator[tuple[Frame, str]]) -> Maps:
    """Embed the windows of maps; maps of plain colours have none and are left out."""
    cut = ((textures.windows(frame, encoder.side), label) for frame, label in frames)
    rows, labels = zip(
        *((encoder.embed(windows), NAMES.index(label)) for windows, label in cut if windows),
        strict=True,
    )
    return Maps(np.stack(rows), np.array(labels))


def _maps(data: Path, source: str) -> Iterator[tuple[Path, str]]:
    """List a source's base-colour maps with their materials."""
    for row in sources.rows(data, source):
        if row["kind"] in ("texture_albedo", "pbr_material"):
            yield data / row["path"], sources.material_of(row["class"])


def _tiles(data: Path) -> Iterator[tuple[Path, str]]:
    for path, label in sources.labelled(data, sources.TILES):
        if not sources.is_tile_held_back(path.name):
            yield path, sources.material_of(label)


def _frame(image: Image.Image) -> Frame:
    return crops.frame(np.asarray(image), purpose="texture")
