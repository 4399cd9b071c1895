"""Make the shipped encoder and gallery: `python -m hapticvlm.training.first_encoder --data DIR`.

Deterministic: the same pictures and the same numpy give the same files. Leaves every source out
once to see what the method is worth and to fit the calibration; then fits all of them.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.recognition import gallery as galleries
from hapticvlm.recognition import linear_encoder as encoders
from hapticvlm.recognition.gallery import Calibration, Gallery
from hapticvlm.recognition.linear_encoder import LinearEncoder
from hapticvlm.training.fit import (
    Fold,
    Table,
    choose_references,
    fit_calibration,
    fit_projection,
    surprise,
)
from hapticvlm.training.samples import FIT, OPEN, SEED, crops, read_labels

NAME = "first-1"


def main(arguments: Sequence[str] | None = None) -> int:
    """Read the command line, build both files, say what they are worth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--out", type=Path, default=encoders.SHIPPED.parent, help="where to write")
    chosen = parser.parse_args(arguments)
    table = describe_all(chosen.data)
    calibration = calibrate(table)
    known = table.rows(table.materials != materials.UNKNOWN)
    encoder = fit_projection(known, NAME, encoders.SIDE)
    gallery = make_gallery(encoder, known, calibration)
    save_encoder(encoder, chosen.out / encoders.SHIPPED.name)
    galleries.save_gallery(gallery, chosen.out / galleries.SHIPPED.name)
    _say(f"{len(gallery.labels)} references of {len(gallery.materials)} materials; {calibration}")
    return 0


def describe_all(data: Path) -> Table:
    """Describe every training crop, with progress on stderr."""
    pictures = read_labels(data, (*FIT, OPEN))
    start, last, rows = time.monotonic(), None, []
    for picture, crop in crops(pictures, encoders.SIDE):
        rows.append((encoders.describe(crop), picture))
        if picture.source != last or len(rows) % 2000 == 0:
            _say(f"{len(rows)} crops, {picture.source}, {time.monotonic() - start:.0f} s")
            last = picture.source
    return Table(
        np.stack([row for row, _ in rows]),
        np.array([picture.material for _, picture in rows]),
        np.array([picture.source for _, picture in rows]),
        np.array([str(picture.path) for _, picture in rows]),
    )


def calibrate(table: Table) -> Calibration:
    """Leave each source out, print what is recognised in it, fit the calibration on all folds."""
    folds, classes = [], len(materials.MATERIALS)
    for source in FIT:
        rest = table.rows((table.sources != source) & (table.materials != materials.UNKNOWN))
        rest = rest.rows(rest.sources != OPEN)
        encoder = fit_projection(rest, NAME, encoders.SIDE)
        made = make_gallery(encoder, rest, Calibration(8.0, 0.0, 0.0))
        left = table.rows((table.sources == source) | (table.sources == OPEN))
        folds.append(_fold(encoder, made, left))
        _print_fold(source, made, folds[-1])
    calibration = fit_calibration(folds, classes)
    for source, fold in zip(FIT, folds, strict=True):
        scores = galleries.score(
            fold.embeddings, fold.references, fold.labels, calibration.sharpness
        )
        loss = surprise(galleries.believe(scores, calibration), fold, classes)
        loss /= fold.weights.sum()
        _say(f"{source}: {loss:.2f} nats of surprise, knowing nothing is {np.log(classes):.2f}")
    return calibration


def make_gallery(encoder: LinearEncoder, table: Table, calibration: Calibration) -> Gallery:
    """Choose references for every material the table has, in the order of the material table."""
    present = set(table.materials.tolist())
    names = tuple(name for name in materials.MATERIALS if name in present)
    embeddings = encoder.project(table.descriptions)
    references, labels = choose_references(embeddings, table, names, SEED)
    return Gallery(encoder.name, names, references, labels, calibration)


def save_encoder(encoder: LinearEncoder, path: Path) -> None:
    """Write an encoder where `load_encoder` finds it."""
    np.savez(
        path,
        name=np.array(encoder.name),
        side=np.array(encoder.side),
        centre=encoder.centre,
        scale=encoder.scale,
        projection=encoder.projection,
    )


def _fold(encoder: LinearEncoder, made: Gallery, left: Table) -> Fold:
    """Pack a left-out source; its classes weigh alike, and so does "none of ours"."""
    index = {name: number for number, name in enumerate(made.materials)}
    truth = np.array([index.get(name, -1) for name in left.materials.tolist()], np.int64)
    weights = np.zeros(len(truth))
    for value in np.unique(truth):
        weights[truth == value] = 1.0 / (truth == value).sum()
    embeddings = encoder.project(left.descriptions)
    return Fold(embeddings, made.references, made.labels, truth, weights)


def _print_fold(source: str, made: Gallery, fold: Fold) -> None:
    guess: NDArray[np.int64] = made.scores(fold.embeddings).argmax(axis=1)
    shares = []
    for value in np.unique(fold.truth[fold.truth >= 0]):
        share = float((guess[fold.truth == value] == value).mean())
        shares.append(f"{made.materials[value]} {share:.0%}")
    _say(f"left out {source}: right without rejecting: {', '.join(shares)}")


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")


if __name__ == "__main__":
    sys.exit(main())
