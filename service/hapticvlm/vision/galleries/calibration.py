"""Calibrates a user's references by leaving each enrolled picture out in turn. Pure.

A calibration says how much a match is worth. It is fitted to the user's own pictures, because the
cosines of one set of pictures predict little about those of another, and it is repeated whenever
references change. A picture must not be judged by references made from itself, so each is matched
with all others only, and the constants are chosen under which the truth is least surprising.
Surprise is the negative log probability of the true material.

`calibrate` works in two steps. First it chooses sharpness, weight and share of the shipped beliefs.
Then it chooses slope and threshold of p(known), such that pictures left out count as known and
unknowns do not. As unknowns serve pictures whose whole material is left out, and shipped references
of other materials.

Leaving out one picture is not enough: users enrol several views of one object without marking them
as such, and the other views would recognise the one left out. So the pictures of its material that
are as near to it as its own variations are left out as well, and the nearest share ALIKE of the
rest.

`leave_one_out` counts how often the nearest reference is of the right material, and
`find_confusable_pairs` lists materials that cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.galleries.gallery import SHIPPED_SHARE, Calibration, Gallery, log_softmax

if TYPE_CHECKING:
    from hapticvlm.vision.galleries.enrol import Enrolled

CONFUSED = 0.25  # share of two materials' pictures confused, from which they cannot be told apart
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
SHARPNESSES = (4.0, 8.0, 16.0, 32.0)
SCALES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 16.0, 23.0, 32.0)  # of the scores: weight x sharpness
SHARES = (SHIPPED_SHARE, 0.6, 1.0)  # exponents of the shipped beliefs
SLOPES = (2.0, 4.0, 8.0, 16.0, 32.0)
THRESHOLDS = tuple(np.arange(-0.6, 1.01, 0.1).tolist())
UNKNOWN_SHARE = 0.1  # share of touched objects whose material is not enrolled: our choice
ALIKE = 0.1  # share of a material's other pictures; chosen on our renders and on choose_web
MAX_PICTURES = 400  # left out in turn; more take seconds and change nothing
# For too few pictures to fit anything: the sharpness of fits to five pictures a material on unseen
# renders, and a threshold that only another view of the same object reaches.
FEW = Calibration(8.0, 16.0, 0.7, 1.0)


@dataclass(frozen=True, slots=True)
class LeaveOneOut:
    """The material of each of P pictures, and that of its nearest reference from another picture.

    The guess is None for the only picture of its material, which cannot be checked.
    """

    truth: tuple[str, ...]
    guess: tuple[str | None, ...]

    def counts(self, material: str, parents: Mapping[str, str]) -> tuple[int, int]:
        """Return how many pictures of a material were right, and how many could be checked.

        A parent of `parents` and its children count as one.
        """
        guesses = [parents.get(each, each) for truth, each in self._pairs() if truth == material]
        return guesses.count(parents.get(material, material)), len(guesses)

    def mistaken(self, material: str, other: str) -> int:
        """Return how many pictures of one material were taken for the other."""
        return self._pairs().count((material, other))

    def _pairs(self) -> list[tuple[str, str]]:
        pairs = zip(self.truth, self.guess, strict=True)
        return [(truth, guess) for truth, guess in pairs if guess is not None]


@dataclass(frozen=True, slots=True)
class ConfusablePair:
    """Two materials that cannot be told apart: `confused` of the `checked` pictures of both."""

    material: str
    other: str
    confused: int
    checked: int


def leave_one_out(enrolled: Enrolled, base: Gallery | None = None) -> LeaveOneOut:
    """Match every picture with all others, and with the references of `base`."""
    owners = [enrolled.pictures[place].material for place in enrolled.places]
    references = enrolled.embeddings
    if base is not None:
        owners += [base.materials[label] for label in base.labels]
        references = np.concatenate([references, base.references])
    names = np.array(owners)
    guesses: list[str | None] = []
    for place, row in enumerate(enrolled.firsts):
        others = np.ones(len(names), np.bool_)
        others[: len(enrolled.places)] = enrolled.places != place
        can_be_right = enrolled.pictures[place].material in names[others]
        # Only the picture's unvaried view is matched, and all of its views are left out: its mirror
        # image would recognise it every time.
        similarities = references[others] @ enrolled.embeddings[row]
        guesses.append(str(names[others][similarities.argmax()]) if can_be_right else None)
    return LeaveOneOut(tuple(picture.material for picture in enrolled.pictures), tuple(guesses))


def find_confusable_pairs(enrolled: Enrolled, checked: LeaveOneOut) -> list[ConfusablePair]:
    """Find pairs that `checked` confuses, or that are nearer to each other than to themselves.

    The materials of a base gallery count only if a picture was taken for one of them.
    """
    pairs = []
    guessed = {guess for guess in checked.guess if guess not in (None, UNKNOWN)}
    enrolled_names = enrolled.materials
    for material, other in combinations(
        (*enrolled_names, *sorted(guessed - set(enrolled_names))), 2
    ):
        confused = checked.mistaken(material, other) + checked.mistaken(other, material)
        count = checked.counts(material, {})[1] + checked.counts(other, {})[1]
        mixed = count > 0 and confused / count >= CONFUSED
        if mixed or (other in enrolled_names and _is_nearer(enrolled, material, other)):
            pairs.append(ConfusablePair(material, other, confused, count))
    return pairs


def _is_nearer(enrolled: Enrolled, material: str, other: str) -> bool:
    """Whether nearest references are nearer across two materials than within them, on average."""
    across = _similarity(enrolled, material, other) + _similarity(enrolled, other, material)
    return across >= _similarity(enrolled, material, material) + _similarity(enrolled, other, other)


def _similarity(enrolled: Enrolled, material: str, other: str) -> float:
    """Return the mean similarity of a material's pictures to the nearest reference of another.

    Both may be the same material; if it has one picture, its own variations are the references.
    """
    materials = np.array([picture.material for picture in enrolled.pictures])
    is_lone = material == other and (materials == material).sum() == 1
    nearest = []
    firsts = enrolled.firsts
    for place in np.flatnonzero(materials == material):
        first = firsts[place]
        eligible = materials[enrolled.places] == other
        eligible &= enrolled.places != place if not is_lone else np.ones(len(eligible), np.bool_)
        eligible[first] = False
        nearest.append((enrolled.embeddings[eligible] @ enrolled.embeddings[first]).max())
    return float(np.mean(nearest))


def calibrate(gallery: Gallery, shipped: Gallery | None = None) -> Calibration:
    """Calibrate user references, beside the shipped gallery if there is one; FEW if too few.

    Children are left out: what a class is worth does not change with what it is divided into.
    """
    gallery = _without_children(gallery)
    left_out = _LeftOut(gallery)
    fitted = FEW
    if is_enough(gallery):
        fitted = _sharpen(left_out, None if shipped is None else _shipped(left_out, shipped))
    if not left_out.has_others.any():
        return fitted
    unknown_scores = [] if shipped is None else [_unknown_scores(gallery, shipped)]
    return _fit_known(left_out, fitted, unknown_scores)


def _without_children(gallery: Gallery) -> Gallery:
    heads, of_label = np.unique(gallery.families, return_inverse=True)
    kept = np.isin(gallery.labels, heads)
    return replace(
        gallery,
        materials=tuple(gallery.materials[head] for head in heads),
        references=gallery.references[kept],
        labels=of_label[gallery.labels[kept]],
        places=places_of(gallery)[kept],
    )


def is_enough(gallery: Gallery) -> bool:
    """Whether two materials have two pictures each, which a fit needs."""
    pictures = np.unique(np.stack([gallery.labels, places_of(gallery)]), axis=1)[0]
    return bool((np.bincount(pictures) >= 2).sum() >= 2)


def places_of(gallery: Gallery) -> Indices:
    """Return the picture of each reference; where unknown, each counts as another picture."""
    return np.arange(len(gallery.labels)) if gallery.places is None else gallery.places


def evenly(truth: Indices) -> Doubles:
    """Return weights (N,) by which every class counts equally; they sum to 1."""
    _, place, counts = np.unique(truth, return_inverse=True, return_counts=True)
    return np.asarray(1.0 / counts[place] / len(counts))


class _LeftOut:
    """Cosines of each picture's first view to all references, and which of these count for it."""

    def __init__(self, gallery: Gallery) -> None:
        keys = np.stack([gallery.labels, places_of(gallery)])
        _, firsts, pictures = np.unique(keys, axis=1, return_index=True, return_inverse=True)
        pictures = pictures.ravel()
        kept = np.arange(0, firsts.size, -(-firsts.size // MAX_PICTURES))
        self.firsts: Indices = firsts[kept]
        self.embeddings = gallery.references[self.firsts]
        self.cosines = (self.embeddings @ gallery.references.T).astype(np.float64)
        same = pictures[None, :] == kept[:, None]
        self.members = np.eye(len(gallery.materials))[gallery.labels]
        self.truth: Indices = gallery.labels[self.firsts]
        of_material = gallery.labels == self.truth[:, None]
        # A user enrols five views of one cup, and four of them would recognise the fifth under any
        # calibration. So references of its material that are as near as its own variations are left
        # out with it, and the nearest share of the rest.
        self.others = ~(same | (self._is_alike(same) & of_material))
        for row, is_other in enumerate(self.others & of_material):
            self.others[row] &= ~self._nearest(row, is_other, pictures)
        self.materials = gallery.materials
        left = self.others @ self.members
        self.has_others = left[np.arange(len(left)), self.truth] > 0

    def _is_alike(self, same: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether references (P, R) are as near as the picture's own variations are on average."""
        varied = same & (self.cosines < 1.0 - 1e-4)
        counts = varied.sum(axis=1)
        means = np.where(varied, self.cosines, 0.0).sum(axis=1) / np.maximum(counts, 1)
        return self.cosines >= np.where(counts > 0, means, np.inf)[:, None]

    def _nearest(
        self, row: int, is_other: NDArray[np.bool_], pictures: Indices
    ) -> NDArray[np.bool_]:
        """Return which references belong to the nearest ALIKE of the material's other pictures."""
        others = np.unique(pictures[is_other])
        nearness = [self.cosines[row][is_other & (pictures == other)].max() for other in others]
        nearest = others[np.argsort(nearness)[::-1][: int(len(others) * ALIKE)]]
        return is_other & np.isin(pictures, nearest)

    def scores(self, sharpness: float, *, unknowns: bool = False) -> Doubles:
        """Return scores (P, C) without the picture itself, or without all of its material."""
        counted = self.others & ~(self.members[:, self.truth].T > 0) if unknowns else self.others
        powers = np.where(counted, np.exp(sharpness * (self.cosines - 1.0)), 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            means = (powers @ self.members) / (counted @ self.members)
            return np.asarray(np.log(np.nan_to_num(means)) / sharpness + 1.0)


def _sharpen(left_out: _LeftOut, shipped: Doubles | None) -> Calibration:
    rows = left_out.has_others
    truth = left_out.truth[rows]
    weights = evenly(truth)
    place = np.arange(len(truth))
    beside = 0.0 if shipped is None else shipped[rows]
    shares = SHARES if shipped is not None else (SHIPPED_SHARE,)
    best = FEW
    least = np.inf
    for sharpness in SHARPNESSES:
        scores = np.maximum(left_out.scores(sharpness)[rows], -10.0)
        for scale, share in product(SCALES, shares):
            right = log_softmax(scale * scores + share * beside)[place, truth]
            surprise = float(-(weights * right).sum())
            if surprise < least:
                weight = scale / sharpness
                best = Calibration(sharpness, 0.0, 0.0, weight, share=share)
                least = surprise
    return best


def _shipped(left_out: _LeftOut, shipped: Gallery) -> Doubles:
    """Return the shipped gallery's beliefs of the pictures, as log probabilities (P, C)."""
    return log_softmax(shipped.shipped_logits(left_out.embeddings, left_out.materials))


def _fit_known(
    left_out: _LeftOut, fitted: Calibration, unknown_scores: list[Doubles]
) -> Calibration:
    """Fit slope and threshold of p(known) to pictures left out and to unknowns."""
    familiar = left_out.scores(fitted.sharpness)[left_out.has_others].max(axis=1)
    if len(left_out.materials) > 1:
        unknown_scores.append(left_out.scores(fitted.sharpness, unknowns=True).max(axis=1))
    if not unknown_scores:
        return fitted
    best = (2.0, THRESHOLDS[0])
    least = np.inf
    for slope, threshold in product(SLOPES, THRESHOLDS):
        # The known must count as known and the unknown as unknown, weighted by how often a hand
        # touches either. Unknowns are each material in turn as if it had not been enrolled, and
        # shipped references that no user material represents.
        known = _surprise_of(familiar, slope, threshold)
        unknown = np.mean([_surprise_of(part, -slope, threshold) for part in unknown_scores])
        surprise = (1.0 - UNKNOWN_SHARE) * known + UNKNOWN_SHARE * float(unknown)
        if surprise < least:
            best = (slope, threshold)
            least = surprise
    return replace(fitted, slope=best[0], threshold=best[1])


def _unknown_scores(gallery: Gallery, shipped: Gallery) -> Doubles:
    """Return the best score (S,) of each shipped reference of a material that is not the user's."""
    parents = {shipped.parent(name) for name in gallery.materials}
    others = [at for at, name in enumerate(shipped.materials) if name not in parents]
    rows = shipped.references[np.isin(shipped.labels, others)]
    return np.asarray(gallery.scores(rows).max(axis=1)) if len(rows) else np.full(1, -1.0)


def _surprise_of(scores: Doubles, slope: float, threshold: float) -> float:
    return float(np.logaddexp(0.0, -slope * (scores - threshold)).mean())
