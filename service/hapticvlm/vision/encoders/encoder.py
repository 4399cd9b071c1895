"""The contract of every encoder: pictures with masks become unit embeddings.

The shipped encoder and networks in ONNX files run on onnxruntime, networks of transformers on torch
(extra `models`), which is imported only for them. All take the same crops, and every embedding is
checked to be finite and of unit norm here, because a gallery would match anything else with
confidence. An encoder's preprocessing belongs to it and lies in its graph or beside its file. Knows
no gallery and no material.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import HapticVLMError
from hapticvlm.vision.pictures import Crop

Floats = NDArray[np.float32]
Pixels = NDArray[np.uint8]

SHIPPED = Path(__file__).parents[1] / "shipped"  # a folder for each encoder that ships
DEFAULT = "lite0"
CARD = "encoder.json"  # lies in the folder of every encoder that runs on onnxruntime
FINGERPRINT = 8  # hexadecimal digits of the weights' SHA-256 in the name of an encoder
BATCH = 8  # crops a pass: bounds memory; more are not faster on one thread
GPU_BATCH = 64  # the same on a GPU, which fewer leave idle: not measured
UNIT_ERROR = 1e-3  # of an embedding's norm


class EncoderError(HapticVLMError):
    """An encoder cannot be loaded or misbehaves; the message says how to fix it."""


class Encoder(Protocol):
    """The interface of every encoder."""

    @property
    def name(self) -> str:
        """Name and version; galleries store it, since their references fit no other encoder."""

    @property
    def side(self) -> int:
        """Side of the crops it takes, px."""

    @property
    def dimension(self) -> int:
        """Length of an embedding."""

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, D) float32, each of unit norm. Raises EncoderError."""


@runtime_checkable
class NetworkEncoder(Encoder, Protocol):
    """A network that the user named; its gallery may have to be made first."""

    @property
    def revision(self) -> str:
        """Distinguishes its weights and preprocessing from those of other networks of its name."""

    @property
    def beliefs(self) -> bool:
        """Whether its embeddings hold beliefs in the materials (joint_embedding)."""


def embed_all(
    crops: Sequence[Crop],
    encoder: Encoder,
    run: Callable[[Pixels], NDArray[np.generic]],
    batch: int = BATCH,
) -> Floats:
    """Embed crops by `run`: (n, S, S, 4) uint8, RGB and mask (0 or 255), to (n, D), n <= batch.

    Returns (N, D) float32, finite and of unit norm. Raises EncoderError.
    """
    parts = [np.zeros((0, encoder.dimension), np.float32)]
    for start in range(0, len(crops), batch):
        # In batches, because the inner layers of thousands of crops at once would take gigabytes.
        # The output of a foreign network is checked here for all kinds of encoders (shape, norm,
        # NaN), so that callers may rely on it.
        pixels = _stack(crops[start : start + batch], encoder)
        parts.append(_require_unit(run(pixels), len(pixels), encoder))
    return np.concatenate(parts)


def _stack(crops: Sequence[Crop], encoder: Encoder) -> Pixels:
    side = encoder.side
    pixels = np.empty((len(crops), side, side, 4), np.uint8)
    for number, crop in enumerate(crops):
        if crop.image.shape != (side, side, 3) or crop.mask.shape != (side, side):
            problem = (
                f"`{encoder.name}` takes crops of {side} px, not {crop.image.shape} with a mask"
            )
            raise EncoderError(f"{problem} of {crop.mask.shape}; cut them at that side")
        for channel in range(3):  # copies four times faster than (S, S, 3) into every fourth byte
            pixels[number, ..., channel] = crop.image[..., channel]
        np.multiply(crop.mask > 0, np.uint8(255), out=pixels[number, ..., 3])
    return pixels


def _require_unit(output: NDArray[np.generic], count: int, encoder: Encoder) -> Floats:
    embeddings: Floats = np.asarray(output, np.float32)
    if embeddings.shape != (count, encoder.dimension):
        expected = (count, encoder.dimension)
        problem = f"`{encoder.name}` gave embeddings of shape {embeddings.shape}, not {expected}"
        raise EncoderError(f"{problem}; load another encoder")
    if not np.isfinite(embeddings).all():
        problem = f"`{encoder.name}` gives numbers that are not finite for a picture"
        cure = "its weights are damaged or overflow; export it again, as float32"
        raise EncoderError(f"{problem}: {cure}, or name another network")
    norms = np.linalg.norm(embeddings, axis=1)
    if not (np.abs(norms - 1.0) <= UNIT_ERROR).all():
        problem = f"`{encoder.name}` gave an embedding that is not of unit norm"
        raise EncoderError(f"{problem}; load another encoder")
    return embeddings
