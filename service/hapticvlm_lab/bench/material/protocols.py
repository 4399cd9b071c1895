"""Recognition with a few references from the same source, drawn object by object.

A user who enrols a few pictures of his own scene is better off than one who relies on the shipped
gallery; this measures by how much. Pictures of one object look so much alike that a method could
recognise the object itself instead of its material. So references are drawn by object: no view of a
tested object is ever a reference. A class gives k references from k objects, or, where it has fewer
than 2 k, from half of its objects with several views each. A class of one object cannot be tested
and is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm_lab.bench.material.scores import Score, Words, interval, score

Floats = NDArray[np.float32]
Numbers = NDArray[np.int64]

REFERENCES = (1, 5, 20)  # per material
DRAWS = 20
SEED = 11


@dataclass(frozen=True, slots=True)
class LabelledEmbeddings:
    """embeddings (N, D) float32 unit, truth (N,) and objects (N,); sharpness of the match."""

    embeddings: Floats
    truth: Words
    objects: Words
    sharpness: float


@dataclass(frozen=True, slots=True)
class Draw:
    """One draw: reference rows (R,), their labels (R,) and the rows to test, boolean (N,)."""

    references: Numbers
    labels: Numbers
    tested: NDArray[np.bool_]


def enrolled(labelled: LabelledEmbeddings, classes: Sequence[str], count: int) -> Score | None:
    """Recognise with `count` references a class, over DRAWS draws; None with under two classes."""
    usable = usable_classes(labelled, classes)
    if len(usable) < 2:
        return None
    rng = np.random.default_rng([SEED, count])
    scores = []
    for _ in range(DRAWS):
        draw = draw_references(labelled, usable, count, rng)
        graded = score(*_match(labelled, draw, usable), usable)
        scores += [graded] if graded is not None else []
    objects_each = len(set(labelled.objects[draw.references].tolist())) // len(usable)
    return _merge(scores, len(draw.references) // len(usable), objects_each)


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
    """Return the classes of two objects or more: one to enrol, one to test."""
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
        objects = np.unique(labelled.objects[labelled.truth == name])
        chosen = rng.choice(objects, min(count, len(objects) // 2), replace=False)
        views = [
            rng.permutation(np.flatnonzero(labelled.objects == object_id)) for object_id in chosen
        ]
        # One view of each object first, then a second of each, until there are enough.
        turns = [v[turn] for turn in range(max(map(len, views))) for v in views if turn < len(v)]
        rows += turns[:count]
        labels += [label] * len(turns[:count])
    others = np.isin(labelled.truth, [*classes, materials.UNKNOWN])
    tested = others & ~np.isin(labelled.objects, labelled.objects[rows])
    return Draw(np.array(rows, np.int64), np.array(labels, np.int64), tested)


def _match(
    labelled: LabelledEmbeddings, draw: Draw, classes: Sequence[str]
) -> tuple[Words, Words, Words]:
    """Return answers, truth and objects of what is tested, by the product's own match."""
    plain = _gallery(labelled, draw.references, draw.labels, classes)
    embeddings = labelled.embeddings[draw.tested]
    truth = labelled.truth[draw.tested]
    objects = labelled.objects[draw.tested]
    return np.array(classes)[plain.scores(embeddings).argmax(axis=1)], truth, objects


def _gallery(
    labelled: LabelledEmbeddings,
    rows: Numbers | NDArray[np.bool_],
    labels: Numbers,
    classes: Sequence[str],
) -> Gallery:
    """Build a gallery of these rows that is not calibrated: the nearest decides."""
    # Sharp, and without any belief in unknown: a forced choice needs no calibration.
    even = Calibration(labelled.sharpness, 0.0, 0.0)
    return Gallery("", tuple(classes), labelled.embeddings[rows], labels, even)


def _merge(draws: Sequence[Score], references: int, objects: int) -> Score:
    """Average over draws; the interval counts the objects a draw tests, the sd is over draws."""
    # All draws test about the same objects, so the interval must not shrink with their number.
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
