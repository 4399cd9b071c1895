"""The gallery: reference embeddings per material, cosine match, calibrated confidence.

A material's score is the soft maximum of the cosine similarities to its references,
s_c = log(mean_r exp(k x.r)) / k with sharpness k, and its belief
p(known) * softmax(k s)_c, p(known) = 1 / (1 + exp(-slope (max s - threshold))).
k, slope and threshold were fitted on sources the encoder had not seen and are stored in the file
with the references, since they mean nothing for another encoder. numpy only; knows no picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.encoder import Encoder
from hapticvlm.recognition.ladder import Evidence

Floats = NDArray[np.float32]

SHIPPED = Path(__file__).with_name("gallery.npz")
LISTED = 3  # beliefs per evidence; the rest of the mass is open


class GalleryError(RuntimeError):
    """A gallery that cannot be used: why, and what to do."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """What turns similarities into beliefs; see the head of this file."""

    sharpness: float
    slope: float
    threshold: float


@dataclass(frozen=True, slots=True)
class Gallery:
    """References of several materials, made with one encoder.

    references (R, D) float32 of unit norm, labels (R,) indices into `materials`.
    """

    encoder: str
    materials: tuple[str, ...]
    references: Floats
    labels: NDArray[np.int64]
    calibration: Calibration

    def match(self, embedding: Floats) -> Evidence:
        """Compare one (D,) embedding; a low sum of beliefs means unknown."""
        if not np.isfinite(embedding).all() or not self.materials:
            return Evidence("encoder", ())
        beliefs = self.beliefs(embedding[None, :])[0]
        best = np.argsort(-beliefs, kind="stable")[:LISTED]
        return Evidence("encoder", tuple((self.materials[i], float(beliefs[i])) for i in best))

    def beliefs(self, embeddings: Floats) -> NDArray[np.float64]:
        """Beliefs of (N, D) embeddings: (N, C) float64; what a row lacks to 1 is unknown."""
        return believe(self.scores(embeddings), self.calibration)

    def scores(self, embeddings: Floats) -> NDArray[np.float64]:
        """Soft-maximum similarities of (N, D) embeddings: (N, C) float64."""
        return score(embeddings, self.references, self.labels, self.calibration.sharpness)


def score(
    embeddings: Floats, references: Floats, labels: NDArray[np.int64], sharpness: float
) -> NDArray[np.float64]:
    """Score (N, D) against (R, D) references of classes 0..C-1: (N, C) float64, about -1..1."""
    powers = np.exp(sharpness * (embeddings @ references.T).astype(np.float64))
    members = np.eye(int(labels.max()) + 1)[labels]
    return np.asarray(np.log(powers @ members / members.sum(axis=0)) / sharpness)


def believe(scores: NDArray[np.float64], calibration: Calibration) -> NDArray[np.float64]:
    """Turn (N, C) scores into (N, C) beliefs; what a row lacks to 1 is unknown."""
    top = scores.max(axis=1, keepdims=True)
    powers = np.exp(calibration.sharpness * (scores - top))
    known = 1.0 / (1.0 + np.exp(-calibration.slope * (top - calibration.threshold)))
    return np.asarray(known * powers / powers.sum(axis=1, keepdims=True))


def save_gallery(gallery: Gallery, path: Path) -> None:
    """Write a gallery to one .npz file; equal galleries give equal bytes."""
    np.savez(
        path,
        encoder=np.array(gallery.encoder),
        materials=np.array(gallery.materials),
        references=gallery.references.astype(np.float16),
        labels=gallery.labels.astype(np.int64),
        calibration=np.array(_numbers(gallery.calibration)),
    )


def load_gallery(path: Path | None = None, *, encoder: Encoder) -> Gallery:
    """Read a gallery (None: the shipped one). Raises GalleryError when made for another encoder."""
    path = path or SHIPPED
    try:
        with np.load(BytesIO(path.read_bytes()), allow_pickle=False) as file:
            made_with = str(file["encoder"])
            names = tuple(str(name) for name in file["materials"])
            references = _unit(file["references"].astype(np.float32))
            labels = file["labels"].astype(np.int64)
            calibration = Calibration(*(float(number) for number in file["calibration"]))
    except (OSError, EOFError, KeyError, ValueError, TypeError, BadZipFile) as error:
        raise GalleryError(f"{path} is no gallery ({error}); make it again") from None
    if made_with != encoder.name:
        text = f"{path} was made with encoder `{made_with}`, not `{encoder.name}`"
        raise GalleryError(f"{text}; make it again with `{encoder.name}` or load `{made_with}`")
    _require_whole(path, references, labels, names, encoder.dimension)
    return Gallery(made_with, names, references, labels, calibration)


def _require_whole(
    path: Path,
    references: Floats,
    labels: NDArray[np.int64],
    names: Sequence[str],
    dimension: int,
) -> None:
    fits = references.ndim == 2 and references.shape == (labels.size, dimension)
    if not fits or not np.isfinite(references).all():
        text = f"{path}: references of shape {references.shape}, expected ({labels.size}, "
        raise GalleryError(f"{text}{dimension}) finite numbers; make it again")
    if sorted(set(labels.tolist())) != list(range(len(names))):
        raise GalleryError(f"{path}: every material needs a reference; make it again")


def _numbers(calibration: Calibration) -> tuple[float, float, float]:
    return calibration.sharpness, calibration.slope, calibration.threshold


def _unit(references: Floats) -> Floats:
    norms = np.linalg.norm(references, axis=-1, keepdims=True)
    return np.asarray(references / np.maximum(norms, np.float32(1e-6)), np.float32)
