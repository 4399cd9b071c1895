"""Every method to recognise a material that the chart compares, behind one interface.

A method has an encoder (crop to embedding), a head (embedding to beliefs without any picture of the
source: zero-shot), or rungs that read what the scene states; all asked through the product's own
functions. What is not available here is left out and reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials, messages
from hapticvlm.vision.encoders.encoder import Encoder, EncoderError
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm.vision.galleries.storage import GalleryError, load_gallery
from hapticvlm_lab.bench.material import logistic
from hapticvlm_lab.bench.material.baselines import ColourHistogram, standardised_on
from hapticvlm_lab.bench.material.data import Cut, Source, crops

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Family = Literal["guess", "stated", "plain", "named", "ours", "ladder"]

NEAREST = Calibration(64.0, 0.0, 0.0)  # so sharp that the nearest reference decides; uncalibrated
TEXTURES = "textures, logistic"
WIDTHS_FROM = 4  # one in so many teaching crops shows how wide textures spread


class Head(Protocol):
    """Embeddings to beliefs. `speaks`: they were calibrated, so that "unknown" means something."""

    @property
    def materials(self) -> tuple[str, ...]:
        """The classes, as beliefs has them."""

    @property
    def speaks(self) -> bool:
        """Whether a low belief means unknown."""

    def beliefs(self, embeddings: Floats) -> Doubles:
        """(N, D) embeddings to (N, C) beliefs, each row at most 1."""

    def familiar(self, embeddings: Floats) -> Doubles:
        """How much (N, D) embeddings look like anything known: (N,)."""


@dataclass(frozen=True, slots=True)
class GalleryHead:
    """The product's gallery; familiarity is its belief, or its score where not calibrated.

    References of UNKNOWN, where it has some, take their share of belief and are no answer.
    """

    gallery: Gallery
    speaks: bool

    @property
    def materials(self) -> tuple[str, ...]:
        """The gallery's, UNKNOWN left out."""
        return self.gallery.candidates

    def beliefs(self, embeddings: Floats) -> Doubles:
        """(N, C)."""
        return self.gallery.beliefs(embeddings)

    def familiar(self, embeddings: Floats) -> Doubles:
        """(N,)."""
        if self.speaks:
            return np.asarray(self.beliefs(embeddings).max(axis=1))
        answers = [self.gallery.materials.index(name) for name in self.materials]
        return np.asarray(self.gallery.scores(embeddings)[:, answers].max(axis=1))


@dataclass(frozen=True, slots=True)
class LogisticHead:
    """Logistic regression on the embeddings of the teaching sources."""

    materials: tuple[str, ...]
    model: logistic.Logistic
    speaks: bool = True

    def beliefs(self, embeddings: Floats) -> Doubles:
        """(N, C)."""
        return self.model.probabilities(embeddings)

    def familiar(self, embeddings: Floats) -> Doubles:
        """(N,)."""
        return np.asarray(self.beliefs(embeddings).max(axis=1))


@dataclass(frozen=True, eq=False)
class Method:
    """One row of the chart. `cut` None: as the source states its objects."""

    name: str
    family: Family
    encoder: Encoder | None = None
    head: Head | None = None
    rungs: frozenset[messages.Rung] = frozenset()
    cut: Cut | None = None
    fused: bool = False
    is_default: bool = False
    references: str = ""

    def fits(self, source: Source) -> bool:
        """Whether the source has what this method needs, and it is not another's double."""
        several = len(source.views) > len(set(source.objects.tolist()))
        boxed = all(view.region is not None for view in source.views)
        cuts = {"mask": {"box", "centre"} if boxed else {"centre"}, "whole": {"centre"}}
        return (
            (several or not self.fused)
            and (bool(source.stated) or not self.rungs)
            and (self.cut is None or self.cut in cuts[source.cut])
        )


def assemble(named: Sequence[str], teaching: Source | None) -> tuple[list[Method], list[str]]:
    """List the available methods, and which are not. Raises EncoderError, GalleryError.

    named: networks as `--encoder` takes them.
    """
    encoder = load_encoder()
    shipped = GalleryHead(load_gallery(encoder=encoder), speaks=True)
    ours = Method("ours", "ours", encoder, shipped, is_default=True, references="shipped")
    found = [Method("majority", "guess"), *_stated(), *_plain(encoder.side, teaching)]
    skipped: list[str] = []

    def attempt(name: str, make: Callable[[], Method]) -> None:
        try:
            found.append(make())
        except (EncoderError, GalleryError, OSError) as error:
            skipped.append(f"{name}: {error}")

    for name in named:
        attempt(name, partial(_named, name))
    return [*found, *_combinations(ours)], skipped


def networks(data: Path | None) -> list[str]:
    """List the other encoders that ship, and the ImageNet networks of the data folder."""
    others = ["lite2"]
    return others + ([] if data is None else sorted(map(str, data.glob("teacher/*.onnx"))))


def for_source(methods: Sequence[Method], source: Source) -> list[Method]:
    """Add what depends on the source: without teaching pictures, textures as wide as its own."""
    if any(method.name == TEXTURES for method in methods):
        return list(methods)
    side = next(method.encoder.side for method in methods if method.is_default and method.encoder)
    texture = standardised_on(crops(source, source.cut, side), side)
    return [*methods, Method(TEXTURES, "plain", texture)]


def reference_head(source: Source | None, encoder: Encoder) -> GalleryHead | None:
    """Nearest reference among teaching pictures; None without them."""
    if source is None:
        return None
    names, labels = _indexed(source)
    found = encoder.embed(crops(source, source.cut, encoder.side))
    return GalleryHead(Gallery(encoder.name, names, found, labels, NEAREST), speaks=False)


def _stated() -> list[Method]:
    name: frozenset[messages.Rung] = frozenset({"name"})
    shader: frozenset[messages.Rung] = frozenset({"shader"})
    return [Method("name", "stated", rungs=name), Method("shader", "stated", rungs=shader)]


def _plain(side: int, teaching: Source | None) -> list[Method]:
    colours = ColourHistogram(side)
    nearest = _taught("colours, nearest", "plain", colours, teaching)
    if teaching is None:
        return [nearest]
    texture = standardised_on(crops(teaching, teaching.cut, side)[::WIDTHS_FROM], side)
    head = _logistic_head(teaching, texture)
    return [nearest, Method(TEXTURES, "plain", texture, head, references="teaching")]


def _combinations(ours: Method) -> list[Method]:
    """Ours by what is known of the object, how often it was seen, and what the scene states."""
    rungs: frozenset[messages.Rung] = frozenset({"name", "shader"})
    again = replace(ours, is_default=False)
    ladder = replace(again, name="ladder", family="ladder", rungs=rungs)
    return [
        ours,
        replace(again, name="ours, box", cut="box"),
        replace(again, name="ours, centre", cut="centre"),
        replace(again, name="ours, fused", fused=True),
        ladder,
        replace(ladder, name="ladder, fused", fused=True),
    ]


def _named(name: str) -> Method:
    """Read a network that a user names as the service does: its classes and our reference rooms."""
    encoder = load_encoder(name)
    head = GalleryHead(load_gallery(encoder=encoder), speaks=True)
    return Method(Path(name).stem, "named", encoder, head, references="shipped rooms")


def _taught(name: str, family: Family, encoder: Encoder, teaching: Source | None) -> Method:
    return Method(name, family, encoder, reference_head(teaching, encoder), references="teaching")


def _logistic_head(teaching: Source, encoder: Encoder) -> LogisticHead:
    names, labels = _indexed(teaching)
    found = encoder.embed(crops(teaching, teaching.cut, encoder.side))
    return LogisticHead(names, logistic.fit(found, labels))


def _indexed(source: Source) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    truth = source.truth.tolist()
    names = tuple(name for name in materials.MATERIALS if name in truth)
    return names, np.array([names.index(name) for name in truth], np.int64)
