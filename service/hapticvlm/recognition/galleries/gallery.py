"""The gallery: reference embeddings per material, cosine match, calibrated confidence.

A material's score is the soft maximum of the cosine similarities to its references,
s_c = log(mean_r exp(k x.r)) / k with sharpness k, and its belief
p(known) * softmax(k s)_c, p(known) = 1 / (1 + exp(-slope (max s - threshold))).
k, slope and threshold were fitted on sources the encoder had not seen and are stored in the file
with the references, since they mean nothing for another encoder. numpy only; knows no picture.

`match` is the one on the frame path: exp(k s_c) is the mean power itself, so one product, one exp
and one sum per material suffice; beyond 1000 references reading them is most of the time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from io import BytesIO
from operator import itemgetter
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import UNKNOWN
from hapticvlm.recognition.encoders.encoder import Encoder
from hapticvlm.recognition.galleries.user_materials import (
    SHORTEST,
    UserMaterial,
    read_folder,
    replace_file,
    table_with,
)
from hapticvlm.recognition.ladder import Evidence

Floats = NDArray[np.float32]

SHIPPED = Path(__file__).parents[1] / "shipped" / "gallery.npz"
FILE_NAME = "gallery.npz"  # in a gallery folder
LISTED = 3  # beliefs per evidence; the rest of the mass is open
MAX_SHARPNESS = 64.0  # exp(64) still leaves room for the sum of any gallery in float32
_LEAST = 1e-30  # of the best reference's power: less counts as this much, so that logs stay finite


class GalleryError(RuntimeError):
    """A gallery that cannot be used: why, and what to do."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """What turns similarities into beliefs; see the head of this file."""

    sharpness: float
    slope: float
    threshold: float


@dataclass(frozen=True, slots=True, eq=False)
class Gallery:
    """References of several materials, made with one encoder.

    references (R, D) float32 of unit norm, labels (R,) indices into `materials`, each of which has
    a reference. UNKNOWN may be one of them: its references show none of the others.
    """

    encoder: str
    materials: tuple[str, ...]
    references: Floats
    labels: NDArray[np.int64]
    calibration: Calibration

    def match(self, embedding: Floats) -> Evidence:
        """Compare one (D,) embedding; a low sum of beliefs means unknown."""
        if not self.materials or not math.isfinite(embedding @ embedding):
            return Evidence("encoder", ())
        blocks, calibration = _blocks(self), self.calibration
        powers = blocks.references @ (np.float32(calibration.sharpness) * embedding)
        np.exp(powers, out=powers)
        means = (np.add.reduceat(powers, blocks.starts) / blocks.counts).tolist()
        total = sum(means)
        if not 0.0 < total < math.inf:  # references that are not finite
            return Evidence("encoder", ())
        found = zip(self.materials, means, strict=True)
        ranked = sorted(found, key=itemgetter(1), reverse=True)[: LISTED + 1]
        share = _known(math.log(ranked[0][1]) / calibration.sharpness, calibration) / total
        said = [(name, mean * share) for name, mean in ranked if name != UNKNOWN]
        return Evidence("encoder", tuple(said[:LISTED]))

    def beliefs(self, embeddings: Floats) -> NDArray[np.float64]:
        """Beliefs of (N, D) embeddings: (N, C) float64; what a row lacks to 1 is unknown.

        So is a column of UNKNOWN.
        """
        return believe(self.scores(embeddings), self.calibration)

    def scores(self, embeddings: Floats) -> NDArray[np.float64]:
        """Soft-maximum similarities of (N, D) embeddings: (N, C) float64."""
        return score(embeddings, self.references, self.labels, self.calibration.sharpness)


def score(
    embeddings: Floats, references: Floats, labels: NDArray[np.int64], sharpness: float
) -> NDArray[np.float64]:
    """Score (N, D) against (R, D) references of classes 0..C-1: (N, C) float64, about -1..1."""
    powers = sharpness * (embeddings @ references.T).astype(np.float64)
    top = powers.max(axis=1, keepdims=True)
    counts = np.bincount(labels)
    sums = np.array([np.bincount(labels, row, counts.size) for row in np.exp(powers - top)])
    means = np.maximum(sums.reshape(-1, counts.size), _LEAST) / counts
    return np.asarray((np.log(means) + top) / sharpness)


def believe(scores: NDArray[np.float64], calibration: Calibration) -> NDArray[np.float64]:
    """Turn (N, C) scores into (N, C) beliefs; what a row lacks to 1 is unknown."""
    top = scores.max(axis=1, keepdims=True)
    powers = np.exp(calibration.sharpness * (scores - top))
    known = 1.0 / (1.0 + np.exp(-calibration.slope * (top - calibration.threshold)))
    return np.asarray(known * powers / powers.sum(axis=1, keepdims=True))


def _known(score: float, calibration: Calibration) -> float:
    return 1.0 / (1.0 + math.exp(min(700.0, -calibration.slope * (score - calibration.threshold))))


@dataclass(frozen=True, slots=True)
class _Blocks:
    """References in order of material: where each material's begin, and how many there are."""

    references: Floats
    starts: NDArray[np.int64]
    counts: NDArray[np.float32]


@lru_cache(maxsize=4)
def _blocks(gallery: Gallery) -> _Blocks:
    order = np.argsort(gallery.labels, kind="stable")
    counts = np.bincount(gallery.labels, minlength=len(gallery.materials))
    starts = np.cumsum(counts) - counts
    references = np.ascontiguousarray(gallery.references[order], np.float32)
    return _Blocks(references, starts, counts.astype(np.float32))


def save_gallery(gallery: Gallery, path: Path) -> None:
    """Write a gallery to one .npz file, whole or not at all; equal galleries give equal bytes."""
    data = BytesIO()
    np.savez(
        data,
        encoder=np.array(gallery.encoder),
        materials=np.array(gallery.materials),
        references=gallery.references.astype(np.float16),
        labels=gallery.labels.astype(np.int64),
        calibration=np.array(_numbers(gallery.calibration)),
    )
    replace_file(path, data.getvalue())


def load_gallery(
    path: Path | None = None, *, encoder: Encoder, own: Sequence[UserMaterial] | None = None
) -> Gallery:
    """Read a gallery (None: the shipped one) for one encoder; raises GalleryError, MaterialError.

    A folder holds gallery.npz (without it the shipped one counts) and the user's own materials;
    `own` are those if they have been read before.
    """
    base = file_of(path)
    gallery = read_gallery(base)
    require_encoder(base, gallery.encoder, encoder)
    _require_dimension(base, gallery.references, encoder)
    own = read_folder(path) if own is None else own
    known = {UNKNOWN, *table_with(own)}
    for name in gallery.materials:
        if name not in known:
            text = f"{base} has references of `{name}`, which is no material; put it into a folder"
            raise GalleryError(f"{text} as {FILE_NAME}, with a {name}.toml beside it")
    for one in own:
        if one.encoder is not None:
            file = (path or SHIPPED.parent) / f"{one.material.name}.toml"
            require_encoder(file, one.encoder, encoder)
            _require_dimension(file, one.references, encoder)
            gallery = with_references(gallery, one.material.name, one.references)
    return gallery


def file_of(path: Path | None) -> Path:
    """Return the file with the references of a gallery given as file, folder or None (shipped)."""
    if path is None or (path.is_dir() and not (path / FILE_NAME).exists()):
        return SHIPPED
    return path / FILE_NAME if path.is_dir() else path


def with_references(gallery: Gallery, name: str, references: Floats) -> Gallery:
    """Add (N, D) references of one material, known or new."""
    names = gallery.materials if name in gallery.materials else (*gallery.materials, name)
    labels = np.full(len(references), names.index(name), np.int64)
    return replace(
        gallery,
        materials=names,
        references=np.concatenate([gallery.references, references]),
        labels=np.concatenate([gallery.labels, labels]),
    )


def read_gallery(path: Path) -> Gallery:
    """Read one .npz file, whichever encoder it was made with. Raises GalleryError."""
    try:
        with np.load(BytesIO(path.read_bytes()), allow_pickle=False) as file:
            made_with = str(file["encoder"])
            names = tuple(str(name) for name in file["materials"])
            references = file["references"].astype(np.float32)
            labels = file["labels"].astype(np.int64)
            calibration = Calibration(*(float(number) for number in file["calibration"]))
    except OSError as error:
        reason = error.strerror or str(error)
        raise GalleryError(f"{path} is no gallery ({reason}); name one, or build it") from None
    except (EOFError, KeyError, ValueError, TypeError, BadZipFile) as error:
        raise GalleryError(f"{path} is no gallery ({error}); build it again") from None
    _require_whole(path, references, labels, names)
    is_sharp = 0.0 < calibration.sharpness <= MAX_SHARPNESS
    if not is_sharp or not np.isfinite(_numbers(calibration)).all():
        raise GalleryError(f"{path}: its calibration is broken; make it again")
    norms = np.linalg.norm(references, axis=1, keepdims=True)
    return Gallery(made_with, names, np.asarray(references / norms), labels, calibration)


def require_encoder(path: Path, made_with: str, encoder: Encoder) -> None:
    """Refuse what was made with another encoder; raises GalleryError naming both."""
    if made_with != encoder.name:
        text = f"{path} was made with encoder `{made_with}`, not `{encoder.name}`"
        raise GalleryError(
            f"{text}; make one with `hapticvlm gallery build --encoder ...`, or load `{made_with}`"
        )


def _require_dimension(path: Path, references: Floats, encoder: Encoder) -> None:
    if references.shape[1] != encoder.dimension:
        text = f"{path}: references of {references.shape[1]} numbers, `{encoder.name}` gives"
        raise GalleryError(f"{text} {encoder.dimension}; make it again")


def _require_whole(
    path: Path, references: Floats, labels: NDArray[np.int64], names: Sequence[str]
) -> None:
    if references.ndim != 2 or labels.shape != references.shape[:1]:
        text = f"references of shape {references.shape} with {labels.size} labels"
        raise GalleryError(f"{path}: {text}; make it again")
    if (
        not (np.linalg.norm(references, axis=1) > SHORTEST).all()
        or not np.isfinite(references).all()
    ):
        raise GalleryError(f"{path}: references that are not of unit length; make it again")
    if sorted(set(labels.tolist())) != list(range(len(names))) or len(set(names)) != len(names):
        raise GalleryError(f"{path}: every material needs a reference; make it again")


def _numbers(calibration: Calibration) -> tuple[float, float, float]:
    return calibration.sharpness, calibration.slope, calibration.threshold
