"""Crops of game kits are read as they were drawn."""

from pathlib import Path

import numpy as np
import pytest

from hapticvlm.vision.loading import load_encoder
from hapticvlm_lab.training import describing, flat_layer
from hapticvlm_lab.training.describing import NAMES

pytestmark = pytest.mark.nightly  # the whole file: it imports torch


def test_crops_are_read_with_their_kit(tmp_path: Path) -> None:
    toy = np.full((224, 224, 4), (150, 90, 40, 255), np.uint8)
    photograph = np.random.default_rng(2).integers(0, 255, (224, 224, 4), np.uint8)
    np.savez(
        tmp_path / "toys.npz",
        big=np.stack([toy, photograph]),
        label=["wood", "metal"],
        path=["kits/toys/chair.glb", "kits/toys/pan.glb"],
    )
    encoder = load_encoder()
    kits = flat_layer.embed(encoder, describing.drawn([tmp_path / "toys.npz"]))
    assert kits.embeddings.shape == (2, encoder.dimension)
    assert kits.sources.tolist() == ["toys", "toys"]
    assert [NAMES[label] for label in kits.labels] == ["wood", "metal"]
