"""Calibration of a user's references by leaving each enrolled picture out in turn. Pure.

`leave_one_out` counts how often the nearest reference is of the right material and finds pairs of
materials that cannot be told apart. `calibrate` fits how much a match is worth. First sharpness,
weight and share are chosen under which the pictures left out are least surprising; then slope and
threshold of p(known), on these pictures against unknowns: pictures whose material is left out
completely, and shipped references of other materials. Surprise is the negative log probability of
the truth. Left out with a picture are those of its material that are as near to it as its own
variations, and the nearest ALIKE of the rest: other views of the same thing, which a user enrols
unmarked. It is repeated whenever references change, for the cosines of one set predict little of
those of another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.galleries.enrol import Enrolled
from hapticvlm.vision.galleries.gallery import SHIPPED_SHARE, Calibration, Gallery, log_softmax

CONFUSED = 0.25  # of two materials' pictures taken for the other: they cannot be told apart
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
SHARPNESSES = (4.0, 8.0, 16.0, 32.0)
SCALES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 16.0, 23.0, 32.0)  # of the scores: weight x sharpness
SHARES = (SHIPPED_SHARE, 0.6, 1.0)  # of the shipped beliefs beside them
SLOPES = (2.0, 4.0, 8.0, 16.0, 32.0)
THRESHOLDS = tuple(np.arange(-0.6, 1.01, 0.1).tolist())
UNKNOWN_SHARE = 0.1  # share of what a hand touches that nobody enrolled: our choice
ALIKE = 0.1  # share of a material's other pictures; chosen on own renders and choose_web
MOST_PICTURES = 400  # left out in turn; more change nothing and take seconds
# Too few pictures to fit anything: as sharp as fits of five a material on fresh renders, and sure
# only of what is as near as another view of the same thing.
FEW = Calibration(8.0, 16.0, 0.7, 1.0)


@dataclass(frozen=True, slots=True)
class LeaveOneOut:
    """Of P pictures left out one by one: what each shows, and whose reference is nearest.

    No guess where nothing else shows that material: there nothing can be checked.
    """

    truth: tuple[str, ...]
    guess: tuple[str | None, ...]

    def counts(self, material: str) -> tuple[int, int]:
        """How many pictures of a material were right, and how many could be checked."""
        guesses = [guess for truth, guess in self._pairs() if truth == material]
        return guesses.count(material), len(guesses)

    def mistaken(self, material: str, other: str) -> int:
        """How many pictures of one material were taken for the other."""
        return self._pairs().count((material, other))

    def _pairs(self) -> list[tuple[str, str]]:
        pairs = zip(self.truth, self.guess, strict=True)
        return [(truth, guess) for truth, guess in pairs if guess is not None]


@dataclass(frozen=True, slots=True)
class ConfusablePair:
    """Two materials that cannot be told apart, and how many pictures show it."""

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
        # Only the picture's unvaried view is matched, and all its views are left out: its mirror
        # image would recognise it every time.
        like = references[others] @ enrolled.embeddings[row]
        guesses.append(str(names[others][like.argmax()]) if can_be_right else None)
    return LeaveOneOut(tuple(picture.material for picture in enrolled.pictures), tuple(guesses))


def find_confusable_pairs(enrolled: Enrolled, checked: LeaveOneOut) -> list[ConfusablePair]:
    """Pairs that the check confuses, or whose pictures are nearer to the other's than to their own.

    The materials of a base gallery count only as far as the check took pictures for them.
    """
    found = []
    guessed = {guess for guess in checked.guess if guess not in (None, UNKNOWN)}
    shown = enrolled.materials
    for material, other in combinations((*shown, *sorted(guessed - set(shown))), 2):
        confused = checked.mistaken(material, other) + checked.mistaken(other, material)
        count = checked.counts(material)[1] + checked.counts(other)[1]
        mixed = count > 0 and confused / count >= CONFUSED
        if mixed or (other in shown and _is_nearer(enrolled, material, other)):
            found.append(ConfusablePair(material, other, confused, count))
    return found


def _is_nearer(enrolled: Enrolled, material: str, other: str) -> bool:
    """Whether on average the nearest reference is nearer across two materials than within them."""
    across = _likeness(enrolled, material, other) + _likeness(enrolled, other, material)
    return across >= _likeness(enrolled, material, material) + _likeness(enrolled, other, other)


def _likeness(enrolled: Enrolled, material: str, other: str) -> float:
    """Mean similarity of a material's pictures to the nearest reference of the other's pictures.

    Within a material with one picture: to that picture's own variations.
    """
    shown = np.array([picture.material for picture in enrolled.pictures])
    is_lone = material == other and (shown == material).sum() == 1
    nearest = []
    firsts = enrolled.firsts
    for place in np.flatnonzero(shown == material):
        first = firsts[place]
        eligible = shown[enrolled.places] == other
        eligible &= enrolled.places != place if not is_lone else np.ones(len(eligible), np.bool_)
        eligible[first] = False
        nearest.append((enrolled.embeddings[eligible] @ enrolled.embeddings[first]).max())
    return float(np.mean(nearest))


def calibrate(gallery: Gallery, shipped: Gallery | None = None) -> Calibration:
    """Calibrate own references, beside the shipped gallery where there is one; FEW if too few."""
    left_out = _LeftOut(gallery)
    fitted = FEW
    if is_enough(gallery):
        fitted = _sharpen(left_out, None if shipped is None else _shipped(left_out, shipped))
    if not left_out.has_others.any():
        return fitted
    unknown_scores = [] if shipped is None else [_unknown_scores(gallery, shipped)]
    return _know(left_out, fitted, unknown_scores)


def is_enough(gallery: Gallery) -> bool:
    """Whether two materials have two pictures each, which a fit takes."""
    pictures = np.unique(np.stack([gallery.labels, places_of(gallery)]), axis=1)[0]
    return bool((np.bincount(pictures) >= 2).sum() >= 2)


def places_of(gallery: Gallery) -> Indices:
    """Return the picture of each reference; each is one of its own where nobody knows."""
    return np.arange(len(gallery.labels)) if gallery.places is None else gallery.places


def evenly(truth: Indices) -> Doubles:
    """Weights (N,) by which every class counts alike; they sum to 1."""
    _, place, counts = np.unique(truth, return_inverse=True, return_counts=True)
    return np.asarray(1.0 / counts[place] / len(counts))


class _LeftOut:
    """Cosines of each picture's first view to all references, and which of these count for it."""

    def __init__(self, gallery: Gallery) -> None:
        keys = np.stack([gallery.labels, places_of(gallery)])
        _, firsts, pictures = np.unique(keys, axis=1, return_index=True, return_inverse=True)
        pictures = pictures.ravel()
        kept = np.arange(0, firsts.size, -(-firsts.size // MOST_PICTURES))
        self.firsts: Indices = firsts[kept]
        self.embeddings = gallery.references[self.firsts]
        self.cosines = (self.embeddings @ gallery.references.T).astype(np.float64)
        same = pictures[None, :] == kept[:, None]
        self.members = np.eye(len(gallery.materials))[gallery.labels]
        self.truth: Indices = gallery.labels[self.firsts]
        of_material = gallery.labels == self.truth[:, None]
        # Leaving out the picture itself is not enough. A user enrols five views of one cup, and the
        # four that stay would recognise the fifth whatever the calibration. So views that are as
        # near as its own variations go with it, and the nearest share of the rest of its material.
        self.others = ~(same | (self._is_alike(same) & of_material))
        for row, is_other in enumerate(self.others & of_material):
            self.others[row] &= ~self._nearest(row, is_other, pictures)
        self.materials = gallery.materials
        left = self.others @ self.members
        self.has_others = left[np.arange(len(left)), self.truth] > 0

    def _is_alike(self, same: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether references are as near as other views of the picture: of the same thing, then."""
        varied = same & (self.cosines < 1.0 - 1e-4)
        counts = varied.sum(axis=1)
        means = np.where(varied, self.cosines, 0.0).sum(axis=1) / np.maximum(counts, 1)
        return self.cosines >= np.where(counts > 0, means, np.inf)[:, None]

    def _nearest(
        self, row: int, is_other: NDArray[np.bool_], pictures: Indices
    ) -> NDArray[np.bool_]:
        """Return which references are of the nearest ALIKE of the material's other pictures."""
        others = np.unique(pictures[is_other])
        nearness = [self.cosines[row][is_other & (pictures == other)].max() for other in others]
        nearest = others[np.argsort(nearness)[::-1][: int(len(others) * ALIKE)]]
        return is_other & np.isin(pictures, nearest)

    def scores(self, sharpness: float, *, unknowns: bool = False) -> Doubles:
        """Scores (P, C) without the picture itself, or without all of its material."""
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
            found = float(-(weights * right).sum())
            if found < least:
                weight = scale / sharpness
                best = Calibration(sharpness, 0.0, 0.0, weight, share=share)
                least = found
    return best


def _shipped(left_out: _LeftOut, shipped: Gallery) -> Doubles:
    """Return what the shipped gallery believes of the pictures, as log probabilities (P, C)."""
    return log_softmax(shipped.shipped_logits(left_out.embeddings, left_out.materials))


def _know(left_out: _LeftOut, fitted: Calibration, unknown_scores: list[Doubles]) -> Calibration:
    """Fit slope and threshold: pictures left out are known, unknowns are not."""
    familiar = left_out.scores(fitted.sharpness)[left_out.has_others].max(axis=1)
    if len(left_out.materials) > 1:
        unknown_scores.append(left_out.scores(fitted.sharpness, unknowns=True).max(axis=1))
    if not unknown_scores:
        return fitted
    best = (2.0, THRESHOLDS[0])
    least = np.inf
    for slope, threshold in product(SLOPES, THRESHOLDS):
        # What is known must count as known and what is unknown as unknown, weighed by how often a
        # hand meets either. Unknowns are made from what is there: each material in turn as if it
        # had never been enrolled, and shipped references that no own material represents.
        known = _surprise_of(familiar, slope, threshold)
        unknown = np.mean([_surprise_of(part, -slope, threshold) for part in unknown_scores])
        found = (1.0 - UNKNOWN_SHARE) * known + UNKNOWN_SHARE * float(unknown)
        if found < least:
            best = (slope, threshold)
            least = found
    return replace(fitted, slope=best[0], threshold=best[1])


def _unknown_scores(gallery: Gallery, shipped: Gallery) -> Doubles:
    """Best cosine (S,) of each shipped reference of another material to any own reference."""
    parents = {shipped.parent(name) for name in gallery.materials}
    others = [at for at, name in enumerate(shipped.materials) if name not in parents]
    rows = shipped.references[np.isin(shipped.labels, others)]
    return np.asarray(gallery.scores(rows).max(axis=1)) if len(rows) else np.full(1, -1.0)


def _surprise_of(scores: Doubles, slope: float, threshold: float) -> float:
    return float(np.logaddexp(0.0, -slope * (scores - threshold)).mean())
