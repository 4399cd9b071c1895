"""Runs `hapticvlm gallery list`: prints a gallery, and how often it is right about pictures.

Each labelled picture is judged as `recognise` judges it: by the gallery alone, the outlined thing
on a plain ground along with the whole picture, and as unknown when the gallery is not sure enough.
Pictures in a folder `unknown` show none of the materials: for them unknown is right.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hapticvlm.commands.progress import track
from hapticvlm.evidence import ladder
from hapticvlm.materials import UNKNOWN
from hapticvlm.statistics import wilson
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.enrol import (
    EnrolError,
    Picture,
    find_pictures,
    frames_of,
    read_frame,
)
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import (
    SHIPPED,
    file_of,
    load_gallery,
    read_gallery,
    require_some,
)
from hapticvlm.vision.galleries.user_materials import UserMaterial, read_folder, table_with
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import PictureError

SAME = 0.9999  # similarity from which a picture is a reference itself; rounding explains the rest

Confusion = dict[str, Counter[str]]  # truth -> guess -> how often


def run(options: argparse.Namespace) -> int:
    """Print the contents of a gallery, and with pictures how often it is right about them.

    Raises EnrolError, GalleryError, MaterialError, EncoderError.
    """
    file = file_of(options.gallery)
    title = "shipped" if file == SHIPPED else str(file)
    require_some(options.gallery)
    gallery, user_materials = read_gallery(file), read_folder(options.gallery)
    rows = [(name, count, "") for name, count in _counted(gallery)]
    rows += [(name, count, "your pictures") for name, count in _counted(gallery.user)]
    rows += [
        (entry.material.name, len(entry.references), f"your own: {_details(entry)}")
        for entry in user_materials
    ]
    figures = None if options.pictures is None else measure(options, user_materials)
    if options.json:
        materials = [
            {"material": name, "references": count, "from": origin} for name, count, origin in rows
        ]
        contents = {"gallery": title, "encoder": gallery.encoder, "materials": materials}
        print(json.dumps(contents if figures is None else {**contents, "recognised": figures}))
        return 0
    print(f"{title}: encoder {gallery.encoder}, {len(gallery.labels)} references")
    for name, count, origin in rows:
        print(f"  {name:<20} {count:>6}  {origin}".rstrip())
    if figures is not None:
        _print_table(figures)
    return 0


def measure(
    options: argparse.Namespace, user_materials: Sequence[UserMaterial]
) -> dict[str, object]:
    """Recognise the labelled pictures; return how often the gallery is right about them."""
    encoder = load_encoder(options.encoder)
    gallery = load_gallery(options.gallery, encoder=encoder, user_materials=user_materials)
    labelled = find_pictures(options.pictures, [*table_with(user_materials), UNKNOWN])
    shown = embed(track(labelled, "reading the pictures"), encoder, outline=options.outline)
    views = [rows for rows, _ in shown]
    table = table_with(user_materials)
    confusion: Confusion = {}
    for picture, (rows, flat) in zip(labelled, shown, strict=True):
        pairs = zip(rows, flat, strict=True)
        evidence = [gallery.match(row, is_flat=each) for row, each in pairs]
        verdict = ladder.decide([ladder.fuse(evidence)], table)
        confusion.setdefault(picture.material, Counter())[verdict.material] += 1
    return {
        "enrolled": sum(bool((rows @ gallery.references.T >= SAME).any()) for rows in views),
        "outlined": sum(len(rows) > 1 for rows in views),
    } | figures_of(confusion)


def _counted(gallery: Gallery | None) -> Iterator[tuple[str, int]]:
    for label, name in enumerate(() if gallery is None else gallery.materials):
        assert gallery is not None
        yield name, int((gallery.labels == label).sum())


def _details(entry: UserMaterial) -> str:
    facts = [
        f"{part}.{fact}={value}"
        for part, changed in entry.facts.items()
        if isinstance(changed, dict)
        for fact, value in changed.items()
    ]
    made_with = f"encoder {entry.encoder}" if entry.encoder else "no pictures"
    words = "words " + (", ".join(entry.material.words) or "none")
    return "; ".join([f"like {entry.like}", made_with, words, *facts])


def embed(
    labelled: Iterable[Picture], encoder: Encoder, *, outline: bool
) -> list[tuple[NDArray[np.float32], list[bool]]]:
    """Embed each picture, and the thing on its plain ground, if any: (1 or 2, D) for each.

    The list beside it says which of these are flat. Raises EnrolError.
    """
    views = []
    for picture in labelled:
        frame = read_frame(picture)
        frames = frames_of(picture, frame) if outline else [frame]
        try:
            crops = [pictures.crop(shown, encoder.side) for shown in frames]
        except PictureError as error:
            raise EnrolError(f"{picture.path}: {error}") from None
        rows = [encoder.embed([crop]) for crop in crops]
        views.append((np.concatenate(rows), [is_flat(crop) for crop in crops]))
    return views


def figures_of(confusion: Confusion) -> dict[str, object]:
    """Return accuracy with its 95 % interval and unknown rate, per material and in total."""
    rows = {truth: _row(guesses[truth], guesses) for truth, guesses in sorted(confusion.items())}
    everything = sum(confusion.values(), Counter[str]())
    right = sum(guesses[truth] for truth, guesses in confusion.items())
    return {
        **_row(right, everything),
        "materials": rows,
        "confusion": {
            truth: dict(guesses.most_common()) for truth, guesses in sorted(confusion.items())
        },
    }


def _row(right: int, guesses: Counter[str]) -> dict[str, object]:
    count = guesses.total()
    return {
        "pictures": count,
        "right": right,
        "accuracy": round(right / count, 4),
        "interval": [round(edge, 4) for edge in wilson(right, count)],
        "unknown_rate": round(guesses[UNKNOWN] / count, 4),
    }


def _print_table(figures: dict[str, object]) -> None:
    rows = figures["materials"]
    confusion = figures["confusion"]
    assert isinstance(rows, dict)
    assert isinstance(confusion, dict)
    print(
        f"{'material':<20} {'pictures':>8} {'right':>7}  {'95 % interval':<15} {'unknown':>7}  "
        "recognised as"
    )
    for name, row in [*rows.items(), ("all", figures)]:
        low, high = row["interval"]
        guesses = ", ".join(f"{other} {n}" for other, n in confusion.get(name, {}).items())
        share = f"{row['accuracy']:.0%}"
        unknown = f"{row['unknown_rate']:.0%}"
        interval = f"{low:.0%} to {high:.0%}"
        print(f"{name:<20} {row['pictures']:>8} {share:>7}  {interval:<15} {unknown:>7}  {guesses}")
    if figures["outlined"]:
        print(
            f"{figures['outlined']} pictures show a thing on a plain ground: its outline counts too"
        )
    if figures["enrolled"]:
        warning = "are references of the gallery themselves: test with others"
        print(f"WARNING: {figures['enrolled']} of {figures['pictures']} pictures {warning}")
