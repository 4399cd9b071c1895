"""The pictures that beliefs are judged on, and what they believe once some of them are enrolled.

They taught, chose and calibrated nothing. References are never of an object that is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.galleries import calibration, enrol
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm_lab.bench.material.data import FOUR, Source
from hapticvlm_lab.bench.material.reading import default_captures, read_capture, read_pictures

DRAWS = 20
SEED = 7

Kind = Literal["renders", "photographs"]

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Seen:
    """Pictures of some materials: truth (N,) indices of names, objects (N,), views of each."""

    name: str
    pictures: Kind
    truth: NDArray[np.int64]
    objects: NDArray[np.str_]
    views: tuple[Floats, ...]

    @property
    def first(self) -> Floats:
        """The unvaried view of each picture, (N, D)."""
        return np.stack([rows[0] for rows in self.views])


def sources_of(data: Path | None) -> list[tuple[Source, Kind]]:
    """Read the sets that only report."""
    found: list[tuple[Source, Kind]] = [
        (read_capture(path), "renders") for path in default_captures()
    ]
    for name in ("caltech101", "report_web") if data is not None else ():
        assert data is not None
        source = read_pictures(data, name)
        if source is not None:
            found.append((source, "photographs"))
    return found


def embed(encoder: Encoder, source: Source, kind: Kind, names: Sequence[str] = FOUR) -> Seen:
    """Embed pictures of materials of these names, each as it is and varied as enrolment does."""
    views = []
    for view in source.views:
        frame = view.as_cut(source.cut)
        try:
            cut = enrol.views(enrol.Picture(view.truth, Path(view.object_id)), frame, encoder.side)
        except enrol.EnrolError:  # one plain colour: recognised all the same
            cut = [pictures.crop(frame, encoder.side)]
        cut = cut if kind == "renders" else cut[:1]
        views.append(np.concatenate([encoder.embed([crop]) for crop in cut]))
    truth = np.array([names.index(name) for name in source.truth])
    return Seen(source.name, kind, truth, source.objects, tuple(views))


def among(beliefs: Doubles, names: Sequence[str], admitted: Sequence[str] = FOUR) -> Doubles:
    """Restrict (N, C) beliefs to the M admitted: (N, M); what was unknown stays so, in scale."""
    kept = beliefs[:, [names.index(name) for name in admitted]]
    unknown = 1.0 - beliefs.sum(axis=1, keepdims=True)
    return np.asarray(kept / (kept.sum(axis=1, keepdims=True) + np.maximum(unknown, 0.0)))


def drawn(seen: Seen, gallery: Gallery, count: int) -> tuple[Doubles, NDArray[np.int64]] | None:
    """Enrol `count` pictures a class DRAWS times; beliefs of all other objects, and their rows."""
    rng = np.random.default_rng([SEED, count])
    found = []
    rows = []
    for _ in range(DRAWS):
        chosen = _draw(seen, count, rng)
        if chosen is None:
            return None
        rest = np.flatnonzero(~np.isin(seen.objects, seen.objects[chosen]))
        own = enrolled(seen, chosen, gallery)
        beliefs = replace(gallery, user=own).beliefs(seen.first[rest])
        found.append(among(beliefs, gallery.candidates))
        rows.append(rest)
    return np.concatenate(found), np.concatenate(rows)


def enrolled(seen: Seen, chosen: NDArray[np.int64], gallery: Gallery) -> Gallery:
    """Make own references of these pictures, calibrated as `gallery build` does."""
    views = [seen.views[row] for row in chosen]
    places = np.repeat(np.arange(len(views)), [len(rows) for rows in views])
    labels = seen.truth[chosen][places]
    own = Gallery(
        gallery.encoder, FOUR, np.concatenate(views), labels, calibration.FEW, places=places
    )
    return replace(own, calibration=calibration.calibrate(own, gallery))


def _draw(seen: Seen, count: int, rng: np.random.Generator) -> NDArray[np.int64] | None:
    """Draw `count` pictures a class, of as many objects as there are, of half of them at most."""
    chosen: list[int] = []
    for label in range(len(FOUR)):
        objects = rng.permutation(np.unique(seen.objects[seen.truth == label]))
        if len(objects) < 2:
            return None
        of = [rng.permutation(np.flatnonzero(seen.objects == name)) for name in objects]
        queue = [
            int(row) for turn in _turns(of[: max(1, min(count, len(of) // 2))]) for row in turn
        ]
        chosen += queue[:count]
    return np.array(chosen)


def _turns(groups: Sequence[NDArray[np.int64]]) -> list[list[int]]:
    longest = max(len(group) for group in groups)
    return [[int(g[turn]) for g in groups if turn < len(g)] for turn in range(longest)]
