"""Reads the held-back sources.

A set that is missing is skipped and reported. Raises CaptureError for one that cannot be read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from msgspec.structs import replace as with_fields
from numpy.typing import NDArray

from hapticvlm import captures, messages
from hapticvlm.demo import CAPTURE
from hapticvlm.scenes.reading import read_scene
from hapticvlm.vision.files import decode_frame
from hapticvlm_lab.bench.material.data import (
    Source,
    Stated,
    View,
    Where,
    by_object,
    thin,
)
from hapticvlm_lab.training import crops, sources

PICTURES = ("caltech101", "report_web", "pb_renders")
Kind = Literal["renders", "photographs", "game kits"]

_RENDERER = re.compile(r"_(arnold|cycles|unreal)$")  # one material of pb_renders, rendered thrice


def load_sources(where: Where) -> tuple[list[Source], list[str]]:
    """Read the sources that exist; the second list names the others. Raises CaptureError."""
    sources_read = [read_capture(where.capture, where.limit)]
    skipped = []
    for name in PICTURES:
        source = None if where.data is None else read_pictures(where.data, name)
        if source is None:
            skipped.append(f"{name}: no labelled pictures; give their folder with --data")
        else:
            sources_read.append(thin(source, where.limit))
    return sources_read, skipped


def read_capture(path: Path, limit: int = 0) -> Source:
    """Read the graded frames of a capture: those with a truth. Raises CaptureError."""
    views: list[View] = []
    stated: dict[str, Stated] = {}
    for line in captures.read(path).lines():
        if line.type == "scene":
            stated |= dict(_stated(thing) for thing in line.fields["objects"])
        elif line.type == "frame" and line.truth is not None:
            views.append(_view(line.fields, line.message(), line.truth))
    ordered = [view for group in by_object(views).values() for view in group]
    helpful = {key: what for key, what in stated.items() if what.name or what.shader}
    return thin(Source(path.name, tuple(ordered), helpful), limit)


def read_pictures(data: Path, name: str) -> Source | None:
    """Read one held-back set of labelled pictures; None if it does not exist."""
    rows = list(sources.labelled(data, name)) if (data / "labels.csv").is_file() else []
    if not rows:
        return None
    views = [
        picture(
            path, sources.material_of(label), _RENDERER.sub("", f"{path.parent.name}/{path.stem}")
        )
        for path, label in rows
    ]
    note = "a class is a few kinds of thing" if name == "caltech101" else "one shape"
    if name in sources.CALIBRATION:
        note += "; calibrates ours, whose confidence is therefore not held back here"
    ordered = [view for group in by_object(views).values() for view in group]
    return Source(name, tuple(ordered), note=note)


def sources_of(data: Path | None, kits: Path | None = None) -> list[tuple[Source, Kind]]:
    """Read the sets that taught, chose and calibrated nothing, with their kind.

    `kits`: folder of drawn game kits, as `hapticvlm_lab/training/kits.py` writes them.
    """
    sets: list[tuple[Source, Kind]] = [(read_capture(CAPTURE), "renders")]
    for name in ("caltech101", "report_web") if data is not None else ():
        assert data is not None
        source = read_pictures(data, name)
        if source is not None:
            sets.append((source, "photographs"))
    if kits is not None:
        sets.append((read_kits(kits, data), "game kits"))
    return sets


def read_kits(folder: Path, data: Path | None = None) -> Source:
    """Read drawn crops of game kits; objects are named by their files. Raises CaptureError.

    With the folder of `data`, which has the kits' files, objects state their largest surface.
    """
    files = sorted(folder.glob("*.npz"))
    if not files:
        drawing = "`python -m hapticvlm_lab.training --only held-back` draws them"
        raise captures.CaptureError(f"{folder} has no KIT.npz; {drawing}")
    views: list[View] = []
    for path in files:
        with np.load(path) as file:
            drawn = zip(file["big"], file["label"].tolist(), file["path"].tolist(), strict=True)
            views += [_drawn(big, label, object_id) for big, label, object_id in drawn]
    ordered = [view for group in by_object(views).values() for view in group]
    stated = {key: _of_file(key, data) for key in dict.fromkeys(view.object_id for view in views)}
    return Source("game kits", tuple(ordered), stated)


def _of_file(object_id: str, data: Path | None) -> Stated:
    """Return what a scene states of an object: its file's name, and its largest surface."""
    name = Path(object_id).stem
    if data is None or not (data / object_id).is_file():
        return Stated(name)
    nodes = read_scene(data / object_id).objects
    surfaces = [node.surfaces[0] for node in nodes if node.surfaces]
    if not surfaces:
        return Stated(name)
    largest = max(surfaces, key=lambda surface: surface.triangles)
    texture = largest.texture
    shown = None if texture is None else decode_frame(texture.read(), data / object_id)
    return Stated(name, largest.shader, largest.label, shown)


def scene_of(object_id: str) -> str:
    """Return the scene of an object: the folder of its kit; all objects of a capture are of one."""
    return object_id.rpartition("/")[0]


def _drawn(big: NDArray[np.uint8], label: str, object_id: str) -> View:
    frame = crops.frame(big[..., :3], big[..., 3] > 0)
    return View(with_fields(frame, mask=None), object_id, label, frame.mask)


def picture(path: Path, truth: str, object_id: str) -> View:
    """Read one JPEG file as a view."""
    from PIL import Image

    data = path.read_bytes()
    width, height = Image.open(BytesIO(data)).size
    frame = messages.Frame(
        id=1, captured_at=0.0, format="jpeg", width=width, height=height, image=data, origin="top"
    )
    return View(frame, object_id, truth)


def _view(fields: Mapping[str, Any], message: Mapping[str, Any], truth: str) -> View:
    shape = {name: fields[name] for name in ("format", "width", "height", "origin")}
    frame = messages.Frame(id=1, captured_at=0.0, image=message["image"], **shape)
    return View(frame, str(fields.get("object_id", "")), truth, message.get("mask"))


def _stated(thing: Mapping[str, Any]) -> tuple[str, Stated]:
    shader = thing.get("shader")
    parameters = None if shader is None else messages.Shader(**shader)
    return thing["object_id"], Stated(thing.get("name"), parameters)
