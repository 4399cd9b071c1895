"""A small map from features to climate classes, and what it is worth beside constants. Pure numpy.

Every source is held back once and told by the others; what is held back is pooled. Intervals are
95 % bootstrap intervals that draw whole places (views of one panorama are one place). Errors are
between the middles of classes and of labels: a proxy, as no temperature was measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.ambient import DEFAULT_C
from hapticvlm.training.climate_data import CLASSES

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
Names = NDArray[np.str_]

PENALTY = 0.01  # on squared weights of features scaled to a typical squared length of 1
LEAST_TAUGHT = 10  # pictures; a class of fewer is not taught: four snowy roads are no climate
STEPS = 300
RESAMPLES = 2000
SEED = 20250502


@dataclass(frozen=True, slots=True)
class Places:
    """N pictures: features (N, F), truth (N,) into CLASSES, middles (N,) degC, source, place."""

    features: Floats
    truth: Indices
    middle_c: Doubles
    source: Names
    place: Names

    def take(self, rows: NDArray[np.bool_] | Indices) -> Places:
        """Return some of the pictures."""
        return Places(
            self.features[rows],
            self.truth[rows],
            self.middle_c[rows],
            self.source[rows],
            self.place[rows],
        )


@dataclass(frozen=True, slots=True)
class Told:
    """What was said of N pictures: classes (N,) and temperatures (N,) degC."""

    classes: Indices
    value_c: Doubles

    def take(self, rows: NDArray[np.bool_]) -> Told:
        """Return what was said of some of the pictures."""
        return Told(self.classes[rows], self.value_c[rows])


@dataclass(frozen=True, slots=True)
class Gain:
    """Mean gain over a constant, with its 95 % interval."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Score:
    """Shares right 0..1 and mean absolute errors in degC, of the map and of a constant."""

    n: int
    places: int
    right: float
    right_constant: float
    right_gain: Gain
    mae_c: float
    mae_c_constant: float
    mae_c_default: float
    mae_c_gain: Gain
    classes: dict[str, str]

    @property
    def earns_its_place(self) -> bool:
        """Whether it beats the constant in both, by intervals above zero."""
        return self.right_gain.low > 0.0 and self.mae_c_gain.low > 0.0

    def as_row(self) -> dict[str, object]:
        """Return the figures, rounded, as JSON has them."""
        rounded = {
            key: round(value, 3) if isinstance(value, float) else value
            for key, value in asdict(self).items()
        }
        return rounded | {"earns_its_place": self.earns_its_place}


def fit(features: Floats, labels: Indices, *, classes_alike: bool) -> Callable[[Floats], Indices]:
    """Fit a logistic regression of (N, F) to labels (N,); return the map to classes.

    `classes_alike` weighs every class the same, else every picture.
    """
    from scipy.optimize import minimize

    present, targets = np.unique(labels, return_inverse=True)
    centre, scale = features.mean(axis=0), features.std(axis=0) + 1e-4
    wanted = np.eye(len(present))[targets]
    sizes = (
        wanted.sum(axis=0) if classes_alike else np.full(len(present), len(labels) / len(present))
    )
    weights = (wanted / sizes).sum(axis=1) / len(present)

    def extend(rows: Floats) -> Doubles:
        standard = (rows - centre) / scale / np.sqrt(rows.shape[1])
        return np.column_stack([standard, np.ones(len(rows))])

    x = extend(features)
    flat = minimize(
        _loss,
        np.zeros(x.shape[1] * len(present)),
        args=(x, wanted, weights),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": STEPS},
    ).x
    matrix = flat.reshape(-1, len(present))
    return lambda rows: present[np.argmax(extend(rows) @ matrix, axis=1)]


def tell_held_back(places: Places, part: Names, *, classes_alike: bool) -> Told:
    """Tell each part of the pictures (N,) by a map fitted to all the others."""
    said = Told(np.zeros(len(part), np.int64), np.zeros(len(part)))
    for held in np.unique(part):
        known = places.take(_taught(places, part != held))
        among = part == held
        tell = fit(known.features, known.truth, classes_alike=classes_alike)
        said.classes[among] = tell(places.features[among])
        said.value_c[among] = _centres(known)[said.classes[among]]
    return said


def most_right(places: Places, part: Names) -> float:
    """Share of the pictures whose class the other parts teach: the most that could be right."""
    taught = [
        np.isin(places.truth[part == held], places.truth[_taught(places, part != held)])
        for held in np.unique(part)
    ]
    return float(np.concatenate(taught).mean())


def hindsight(places: Places) -> Told:
    """Return the constants that are best for just these pictures; no method could know them."""
    count = len(places.truth)
    most = int(np.bincount(places.truth).argmax())
    return Told(np.full(count, most), np.full(count, float(np.median(places.middle_c))))


def learned(places: Places, part: Names) -> Told:
    """Return the constants that the other parts teach each part."""
    said = Told(np.zeros(len(part), np.int64), np.zeros(len(part)))
    for held in np.unique(part):
        among = part == held
        said.classes[among] = np.bincount(places.truth[~among]).argmax()
        said.value_c[among] = np.median(places.middle_c[~among])
    return said


def compare(places: Places, said: Told, constant: Told) -> Score:
    """Score what was said beside a constant."""
    right, right_constant = (told.classes == places.truth for told in (said, constant))
    error, error_constant = (np.abs(told.value_c - places.middle_c) for told in (said, constant))
    return Score(
        n=len(places.truth),
        places=len(np.unique(places.place)),
        right=float(right.mean()),
        right_constant=float(right_constant.mean()),
        right_gain=gain(right.astype(float) - right_constant, places.place),
        mae_c=float(error.mean()),
        mae_c_constant=float(error_constant.mean()),
        mae_c_default=float(np.abs(DEFAULT_C - places.middle_c).mean()),
        mae_c_gain=gain(error_constant - error, places.place),
        classes=_per_class(places.truth, right),
    )


def gain(differences: Doubles, place: Names) -> Gain:
    """Mean of (N,) differences and its bootstrap interval, drawing whole places."""
    _, at = np.unique(place, return_inverse=True)
    sums, sizes = np.bincount(at, differences), np.bincount(at)
    draws = np.random.default_rng(SEED).integers(0, len(sizes), (RESAMPLES, len(sizes)))
    means = sums[draws].sum(axis=1) / sizes[draws].sum(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return Gain(*(round(float(value), 3) for value in (differences.mean(), low, high)))


def _loss(flat: Doubles, x: Doubles, wanted: Doubles, weights: Doubles) -> tuple[float, Doubles]:
    matrix = flat.reshape(-1, wanted.shape[1])
    logits = x @ matrix
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    belief = powers / powers.sum(axis=1, keepdims=True)
    surprise = -np.log(np.maximum((belief * wanted).sum(axis=1), 1e-12))
    shrink = np.full((len(matrix), 1), PENALTY)
    shrink[-1] = 0.0
    slope = x.T @ ((belief - wanted) * weights[:, None]) + shrink * matrix
    return float(weights @ surprise + 0.5 * (shrink * matrix**2).sum()), slope.ravel()


def _taught(places: Places, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of the known pictures those of classes that have enough of them."""
    counts = np.bincount(places.truth[known], minlength=len(CLASSES))
    return np.asarray(known & (counts[places.truth] >= LEAST_TAUGHT))


def _centres(places: Places) -> Doubles:
    """Mean of the labels' middles of every class, NaN where there is none: (C,) degC."""
    sums = np.bincount(places.truth, places.middle_c, minlength=len(CLASSES))
    counts = np.bincount(places.truth, minlength=len(CLASSES))
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _per_class(truth: Indices, right: NDArray[np.bool_]) -> dict[str, str]:
    """Say "right/all" of every class that occurs."""
    return {
        CLASSES[index]: f"{int(right[truth == index].sum())}/{int((truth == index).sum())}"
        for index in np.unique(truth)
    }
