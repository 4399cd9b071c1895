"""Runs `hapticvlm gallery build` and `add`: makes and extends a gallery."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hapticvlm import documents
from hapticvlm.commands.progress import working
from hapticvlm.errors import shell_word
from hapticvlm.evidence.ladder import decide
from hapticvlm.materials import UNKNOWN, Material, MaterialError, derive
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.galleries import calibration
from hapticvlm.vision.galleries.calibration import (
    LeaveOneOut,
    find_confusable_pairs,
    leave_one_out,
)
from hapticvlm.vision.galleries.enrol import (
    EnrolError,
    Enrolled,
    enrol,
    find_pictures,
    list_pictures,
)
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import (
    FILE_NAME,
    SHIPPED,
    GalleryError,
    file_of,
    is_shipped,
    load_gallery,
    require_encoder,
    save_gallery,
)
from hapticvlm.vision.galleries.user_materials import (
    MAX_USER_MATERIALS,
    UserMaterial,
    is_empty,
    read_folder,
    table_with,
    write_material,
)
from hapticvlm.vision.loading import load_encoder


def build(options: argparse.Namespace) -> int:
    """Make a gallery file from a folder of pictures."""
    file = options.out if options.out.suffix == ".npz" else options.out / FILE_NAME
    user_materials = read_folder(file.parent) if file.name == FILE_NAME else ()
    pictures = find_pictures(options.folder, table_with(user_materials))
    encoder = load_encoder(options.encoder)
    for entry in user_materials:
        if entry.encoder is not None:
            require_encoder(file.parent / f"{entry.material.name}.toml", entry.encoder, encoder)
    base = _require_shipped(encoder) if options.base == "shipped" else None
    enrolled = enrol(pictures, encoder, outline=options.outline)
    parents = {entry.material.name: entry.like for entry in user_materials}
    gallery, origin = _gallery_of(enrolled, encoder, base, parents)
    file.parent.mkdir(parents=True, exist_ok=True)
    save_gallery(gallery, file)
    _print_enrolled(enrolled, leave_one_out(enrolled, base), len(pictures), parents)
    if is_shipped(encoder):
        _print_said(enrolled, gallery, base or load_gallery(encoder=encoder), user_materials)
    print(f"calibration: {origin}")
    count = f"{len(enrolled.places)} references of {len(enrolled.materials)} materials"
    count += " beside the shipped ones" if base is not None else ""
    print(
        f"{file}: {count}, encoder {encoder.name}; "
        f"use it: hapticvlm serve --gallery {shell_word(options.out)}"
    )
    return 0


def add(options: argparse.Namespace) -> int:
    """Write the file of a user's material into a gallery folder."""
    folder: Path = options.out
    words = None if options.words is None else [word.strip() for word in options.words.split(",")]
    facts = _facts(options.facts)
    material = derive(options.name, options.like, words, facts)
    _require_room(folder, material)
    encoder = load_encoder(options.encoder)
    base = _base_of(folder, encoder)
    pictures = list_pictures(material.name, options.pictures)
    with working("reading the pictures"):
        enrolled = enrol(pictures, encoder, outline=options.outline)
    folder.mkdir(parents=True, exist_ok=True)
    views = tuple(np.bincount(enrolled.places).tolist())
    user_material = UserMaterial(
        material, options.like, facts, encoder.name, enrolled.embeddings, views
    )
    path = write_material(user_material, folder)
    _print_enrolled(enrolled, leave_one_out(enrolled, base), len(pictures), {})
    print(
        f"{path}: like {options.like}, encoder {encoder.name}; "
        f"use it: hapticvlm serve --gallery {shell_word(folder)}"
    )
    return 0


def _gallery_of(
    enrolled: Enrolled, encoder: Encoder, base: Gallery | None, parents: Mapping[str, str]
) -> tuple[Gallery, str]:
    """Join the references; return the gallery and the origin of its calibration."""
    labels = enrolled.labels[enrolled.places]
    user_gallery = Gallery(
        encoder.name,
        enrolled.materials,
        enrolled.embeddings,
        labels,
        calibration.FEW,
        parents=parents if base is None else {},  # beside shipped references all are rivals
        places=enrolled.places,
    )
    user_gallery = replace(user_gallery, calibration=calibration.calibrate(user_gallery, base))
    return user_gallery if base is None else replace(base, user=user_gallery), _origin(
        user_gallery, encoder
    )


def _origin(user_gallery: Gallery, encoder: Encoder) -> str:
    """Describe how the references are calibrated. Raises EnrolError where they cannot be."""
    if calibration.is_enough(user_gallery):
        count = len(
            np.unique(
                np.stack([user_gallery.labels, calibration.places_of(user_gallery)]), axis=1
            ).T
        )
        return f"fitted on these {count} pictures left out in turn; few make it rough"
    needed = "a fit needs two materials with two pictures each"
    if not is_shipped(encoder):
        reason = f"no calibration is known for encoder `{encoder.name}`"
        raise EnrolError(f"{reason}; {needed}; add pictures")
    return f"a rough default for few pictures; {needed}"


def _require_shipped(encoder: Encoder) -> Gallery:
    if not is_shipped(encoder):
        reason = f"no references are shipped for encoder `{encoder.name}`"
        raise GalleryError(f"--base shipped: {reason}; leave --base out")
    return load_gallery(encoder=encoder)


def _base_of(folder: Path, encoder: Encoder) -> Gallery:
    """Read the gallery that a folder is, or will be with one more material."""
    path = folder if folder.is_dir() and not is_empty(folder) else None
    if file_of(path) == SHIPPED and not is_shipped(encoder):
        reason = f"has no {FILE_NAME} for encoder `{encoder.name}`; make one first:"
        raise GalleryError(f"{folder}: {reason} gallery build PICTURES -o {folder} --encoder ...")
    return load_gallery(path, encoder=encoder)


def _require_room(folder: Path, material: Material) -> None:
    if folder.suffix == ".npz" or folder.is_file():
        cure = f"materials of your own need a folder; move the file into one as {FILE_NAME}"
        raise MaterialError(f"--out {folder}: {cure} and give that folder")
    path = folder / f"{material.name}.toml"
    if path.exists():
        raise MaterialError(f"{path}: is there already; remove it, or choose another name")
    if len(read_folder(folder)) >= MAX_USER_MATERIALS:
        raise MaterialError(
            f"{folder}: has {MAX_USER_MATERIALS} materials, which is the limit; remove one"
        )


def _facts(settings: Sequence[str]) -> dict[str, object]:
    """Read settings FACT=VALUE, each as one line of TOML."""
    facts: dict[str, dict[str, object]] = {}
    for setting in settings:
        try:
            parsed = documents.parse_toml(setting)
        except ValueError:
            parsed = {}
        if not parsed or not all(isinstance(changed, dict) for changed in parsed.values()):
            expected = "expected FACT=VALUE, such as thermal.conductivity=0.2"
            raise MaterialError(f"--set {setting}: {expected}")
        for part, changed in parsed.items():
            facts[part] = facts.get(part, {}) | changed
    return dict(facts)


def _print_said(
    enrolled: Enrolled, gallery: Gallery, shipped: Gallery, user_materials: Sequence[UserMaterial]
) -> None:
    """Print what the gallery says of each picture without it, and what the shipped eye says."""
    own = gallery.user or gallery
    table = table_with(user_materials)
    parents = {entry.material.name: entry.like for entry in user_materials}
    said: dict[str, Counter[bool | None]] = {
        "your gallery": Counter(),
        "the shipped eye": Counter(),
    }
    checked = np.flatnonzero(np.bincount(enrolled.labels)[enrolled.labels] > 1)
    for place in checked[:: -(-len(checked) // calibration.MAX_PICTURES) or 1]:
        kept = enrolled.places != place
        rest = replace(own, references=own.references[kept], labels=own.labels[kept], places=None)
        rest = rest if gallery.user is None else replace(gallery, user=rest)
        truth = enrolled.pictures[place].material
        for counts, eye in zip(said.values(), (rest, shipped), strict=True):
            row = enrolled.embeddings[enrolled.firsts[place]]
            match = eye.match(row, is_flat=enrolled.flat[place])
            name = decide([match], table).material
            is_right = parents.get(name, name) == parents.get(truth, truth)
            counts[None if name == UNKNOWN else is_right] += 1
    parts = [f"{who} says {n[True]} rightly, {n[False]} wrongly" for who, n in said.items()]
    if count := said["your gallery"].total():
        print(f"of {count} pictures, each left out, {'; '.join(parts)}")


def _print_enrolled(
    enrolled: Enrolled, checked: LeaveOneOut, total: int, parents: Mapping[str, str]
) -> None:
    """Print what was read of `total` pictures, and how often each is right when left out."""
    if total > len(enrolled.pictures):
        print(f"{total - len(enrolled.pictures)} of {total} pictures are copies and count once")
    if enrolled.outlined:
        note = (
            "show a thing on a plain ground and are cut to its outline (--no-outline: as they are)"
        )
        print(f"{enrolled.outlined} of {len(enrolled.pictures)} pictures {note}")
    print(f"{'material':<20} {'pictures':>8} {'references':>10}  nearest is right when left out")
    for name in enrolled.materials:
        right, count = checked.counts(name, parents)
        checks = f"{right} of {count}" if count else "nothing else shows it: cannot be checked"
        pictures = sum(picture.material == name for picture in enrolled.pictures)
        print(f"{name:<20} {pictures:>8} {len(enrolled.references(name)):>10}  {checks}")
    for pair in find_confusable_pairs(enrolled, checked):
        reason = "as near to each other's pictures as to their own"
        if pair.confused:
            reason = f"{pair.confused} of {pair.checked} pictures taken for the other"
        print(f"WARNING: {pair.material} and {pair.other} cannot be told apart: {reason}")
