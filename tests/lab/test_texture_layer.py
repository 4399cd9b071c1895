"""The layer of texture maps is fitted to tiles, and atlases are left open."""

from dataclasses import replace

import numpy as np

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm_lab.training.describing import NAMES
from hapticvlm_lab.training.texture_layer import Maps, calibrate, fit

SIDE = 24  # numbers of an embedding
DICE = np.random.default_rng(8)
CENTRES = DICE.normal(0.0, 1.0, (4, SIDE)) / np.sqrt(SIDE)
MATERIALS = ("wood", "metal", "fabric", "stone")


def maps(count: int, *, mixed: bool = False) -> Maps:
    """Draw maps of each material, or atlases whose windows show one material each."""
    labels = np.repeat(np.arange(4), count)
    shown = DICE.integers(0, 4, (len(labels), 6)) if mixed else np.repeat(labels[:, None], 6, 1)
    windows = CENTRES[shown] + DICE.normal(0.0, 0.06, (len(labels), 6, SIDE))
    windows /= np.linalg.norm(windows, axis=2, keepdims=True)
    names = [UNKNOWN if mixed else MATERIALS[label] for label in labels]
    places = np.array([NAMES.index(name) for name in names])
    return Maps(windows.astype(np.float32), places)


def test_maps_are_told_apart_and_atlases_are_left_open() -> None:
    references = np.eye(len(NAMES), SIDE, dtype=np.float32)
    plain = Calibration(12.0, 1.0, -1000.0, 0.0)
    empty = Gallery("x", NAMES, references, np.arange(len(NAMES)), plain)
    taught = replace(empty, texture_layer=fit(maps(40)))
    gallery = calibrate(taught, maps(10), maps(10, mixed=True))
    others = maps(10)
    for windows, label in zip(others.windows, others.labels, strict=True):
        assert gallery.match_texture(windows).material == NAMES[label]
    atlases = maps(10, mixed=True)
    said = [gallery.match_texture(windows).confidence > 0.5 for windows in atlases.windows]
    sure = [gallery.match_texture(windows).confidence > 0.5 for windows in others.windows]
    assert np.mean(said) < 0.2
    assert np.mean(sure) > 0.8
