"""A check of enrolled pictures: each is left out in turn and compared with the others.

Counts how often the nearest reference is of the right material, and finds pairs of materials that
cannot be told apart. Pure; reads no file.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.galleries.enrol import Enrolled
from hapticvlm.vision.galleries.gallery import Gallery

CONFUSED = 0.25  # of two materials' pictures taken for the other: they cannot be told apart


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
