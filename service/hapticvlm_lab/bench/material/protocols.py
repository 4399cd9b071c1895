"""With references from the same source: enrolled with a few, and a linear probe. By object.

References are drawn by object: no view of a tested object is ever a reference or trains a probe.
A class gives k references from k objects, or, where it has fewer than 2 k, from half of its
objects with several views each; a class of one object cannot be tested and is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm_lab.bench.material import logistic
from hapticvlm_lab.bench.material.scores import Rejection, Score, Words, interval, rejection, score

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Numbers = NDArray[np.int64]

REFERENCES = (1, 5, 20)  # per material
DRAWS = 20
FOLDS = 5
SEED = 11


@dataclass(frozen=True, slots=True)
class LabelledEmbeddings:
    """embeddings (N, D) float32 unit, truth (N,) and objects (N,); sharpness of the match.

    `fused`: an object is judged by the mean belief of its views.
    """

    embeddings: Floats
    truth: Words
    objects: Words
    sharpness: float
    fused: bool = False


@dataclass(frozen=True, slots=True)
class Draw:
    """One draw: reference rows (R,), their labels (R,) and the rows to test, boolean (N,)."""

    references: Numbers
    labels: Numbers
    tested: NDArray[np.bool_]


def enrolled(
    labelled: LabelledEmbeddings, classes: Sequence[str], count: int
) -> tuple[Score | None, Rejection | None]:
    """Recognise with `count` references a class, over DRAWS draws; None with under two classes."""
    usable = usable_classes(labelled, classes)
    if len(usable) < 2:
        return None, None
    rng = np.random.default_rng([SEED, count])
    scores = []
    rejected = []
    for _ in range(DRAWS):
        draw = draw_references(labelled, usable, count, rng)
        answers, truth, objects, familiar = _match(labelled, draw, usable)
        graded = score(answers, truth, objects, usable)
        scores += [graded] if graded is not None else []
        rejected.append(rejection(familiar, np.isin(truth, usable), objects))
    objects_each = len(set(labelled.objects[draw.references].tolist())) // len(usable)
    return _merge(scores, len(draw.references) // len(usable), objects_each), _mean(rejected)


def probe(labelled: LabelledEmbeddings, classes: Sequence[str]) -> Score | None:
    """Logistic regression inside the source, FOLDS-fold by object; None with under two classes."""
    usable = usable_classes(labelled, classes)
    if len(usable) < 2:
        return None
    rows = np.flatnonzero(np.isin(labelled.truth, usable))
    labels = np.array([usable.index(name) for name in labelled.truth[rows].tolist()], np.int64)
    folds = _folds(labelled, rows, usable)
    believed = np.zeros((len(rows), len(usable)))
    for fold in sorted(set(folds.tolist())):
        train = rows[folds != fold]
        test = rows[folds == fold]
        model = logistic.fit(labelled.embeddings[train], labels[folds != fold])
        believed[folds == fold] = model.probabilities(labelled.embeddings[test])
    objects = labelled.objects[rows]
    truth = labelled.truth[rows]
    if labelled.fused:
        believed, truth, objects = _by_object(believed, truth, objects)
    return score(np.array(usable)[believed.argmax(axis=1)], truth, objects, usable)


def left_out(known: LabelledEmbeddings, embeddings: Floats) -> Words:
    """Recognise each row of (N, D) embeddings with all `known` views but its own object's: (N,)."""
    answers = np.full(len(known.truth), "", known.truth.dtype)
    for object_id in np.unique(known.objects):
        mine = known.objects == object_id
        classes = sorted(set(known.truth[~mine].tolist()))
        if classes:
            truth = known.truth[~mine].tolist()
            labels = np.array([classes.index(name) for name in truth], np.int64)
            plain = _gallery(known, ~mine, labels, classes)
            answers[mine] = np.array(classes)[plain.scores(embeddings[mine]).argmax(axis=1)]
    return answers


def usable_classes(labelled: LabelledEmbeddings, classes: Sequence[str]) -> list[str]:
    """Classes of two objects or more: one to enrol, one to test."""
    return [
        name for name in classes if len(set(labelled.objects[labelled.truth == name].tolist())) > 1
    ]


def draw_references(
    labelled: LabelledEmbeddings, classes: Sequence[str], count: int, rng: np.random.Generator
) -> Draw:
    """Draw `count` references a class; every view of an object they show is left untested."""
    rows: list[int] = []
    labels: list[int] = []
    for label, name in enumerate(classes):
        found = np.unique(labelled.objects[labelled.truth == name])
        chosen = rng.choice(found, min(count, len(found) // 2), replace=False)
        views = [
            rng.permutation(np.flatnonzero(labelled.objects == object_id)) for object_id in chosen
        ]
        turns = [v[turn] for turn in range(max(map(len, views))) for v in views if turn < len(v)]
        rows += turns[:count]
        labels += [label] * len(turns[:count])
    others = np.isin(labelled.truth, [*classes, materials.UNKNOWN])
    tested = others & ~np.isin(labelled.objects, labelled.objects[rows])
    return Draw(np.array(rows, np.int64), np.array(labels, np.int64), tested)


def _match(
    labelled: LabelledEmbeddings, draw: Draw, classes: Sequence[str]
) -> tuple[Words, Words, Words, Doubles]:
    """Answers, truth, objects and familiarity of what is tested, by the product's own match."""
    plain = _gallery(labelled, draw.references, draw.labels, classes)
    embeddings = labelled.embeddings[draw.tested]
    truth = labelled.truth[draw.tested]
    objects = labelled.objects[draw.tested]
    scores = familiar = plain.scores(embeddings)
    if labelled.fused:
        familiar, *_ = _by_object(scores, truth, objects)
        scores, truth, objects = _by_object(plain.beliefs(embeddings), truth, objects)
    return np.array(classes)[scores.argmax(axis=1)], truth, objects, familiar.max(axis=1)


def _gallery(
    labelled: LabelledEmbeddings,
    rows: Numbers | NDArray[np.bool_],
    labels: Numbers,
    classes: Sequence[str],
) -> Gallery:
    """Make a gallery of these rows that is not calibrated: the nearest decides."""
    even = Calibration(labelled.sharpness, 0.0, 0.0)
    return Gallery("", tuple(classes), labelled.embeddings[rows], labels, even)


def _by_object(values: Doubles, truth: Words, objects: Words) -> tuple[Doubles, Words, Words]:
    """Mean row of each object, with its truth and id."""
    names, first, which = np.unique(objects, return_index=True, return_inverse=True)
    sums = np.zeros((len(names), values.shape[1]))
    np.add.at(sums, which, values)
    return sums / np.bincount(which)[:, None], truth[first], names


def _folds(labelled: LabelledEmbeddings, rows: Numbers, classes: Sequence[str]) -> Numbers:
    """Give each row its fold: objects of a class go round the folds in a drawn order."""
    rng = np.random.default_rng(SEED)
    fold_of: dict[str, int] = {}
    for name in classes:
        order = rng.permutation(np.unique(labelled.objects[labelled.truth == name]))
        fold_of |= {object_id: at % FOLDS for at, object_id in enumerate(order.tolist())}
    return np.array([fold_of[object_id] for object_id in labelled.objects[rows].tolist()], np.int64)


def _merge(draws: Sequence[Score], references: int, objects: int) -> Score:
    """Mean over draws; the interval is that of the objects a draw tests, the sd that of draws."""
    first = draws[0]
    shares = [draw.accuracy for draw in draws]
    mean = float(np.mean(shares))
    low, high = interval(mean, list(first.classes.values()))
    table: dict[str, dict[str, int]] = {}
    for draw in draws:
        for truth, cells in draw.confusion.items():
            row = table.setdefault(truth, {})
            for answer, n in cells.items():
                row[answer] = row.get(answer, 0) + n
    recall = {c: float(np.mean([draw.recall[c] for draw in draws])) for c in first.recall}
    return replace(
        first,
        accuracy=mean,
        low=low,
        high=high,
        recall=recall,
        confusion=table,
        sd=float(np.std(shares)),
        references=references,
        reference_objects=objects,
    )


def _mean(draws: Sequence[Rejection | None]) -> Rejection | None:
    found = [draw for draw in draws if draw is not None]
    if not found:
        return None
    means = (float(np.mean([getattr(d, k) for d in found])) for k in ("rejected", "low", "high"))
    return Rejection(found[0].n, *means)
