"""Captures to streams: the looks at each object, as the service would take them, one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from io import BytesIO
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import captures
from hapticvlm.messages import Frame
from hapticvlm.recognition import pictures
from hapticvlm.recognition.encoder import Encoder
from hapticvlm.recognition.gallery import Gallery
from hapticvlm.recognition.ladder import Evidence

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """N frames that show one object, in order.

    truth (N,) and evidence (N,) objects; embeddings (N, D); size (N,) is the root of the object's
    area in px, sharpness (N,) the mean gradient under the mask in grey levels per px; is_new (N,)
    marks pictures that have changed, which alone the service looks at.
    """

    truth: NDArray[np.object_]
    evidence: NDArray[np.object_]
    embeddings: Floats
    size: Floats
    sharpness: Floats
    is_new: NDArray[np.bool_]

    def part(self, chosen: NDArray[np.bool_] | slice) -> Stream:
        """Keep some of the frames."""
        return Stream(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def then(self, other: Stream) -> Stream:
        """Go on with the frames of another object, under the same id."""
        names = [field.name for field in fields(self)]
        return Stream(*(np.concatenate([getattr(self, n), getattr(other, n)]) for n in names))


def read_streams(folder: Path, encoder: Encoder, gallery: Gallery) -> list[Stream]:
    """Look at every frame with an object id and a truth. Raises CaptureError, PictureError."""
    found: dict[str, list[tuple[Frame, str]]] = {}
    for line in captures.read(folder).lines():
        object_id = line.fields.get("object_id")
        if line.type == "frame" and object_id and line.truth:
            frame = msgspec.convert(line.message() | {"id": 1}, Frame)
            found.setdefault(object_id, []).append((frame, line.truth))
    return [_look(shown, encoder, gallery) for shown in found.values()]


def _look(shown: Sequence[tuple[Frame, str]], encoder: Encoder, gallery: Gallery) -> Stream:
    crops = [pictures.crop(frame, encoder.side) for frame, _ in shown]
    # One by one, as the service looks: int8 networks scale by all that is in a batch.
    embeddings = np.concatenate([encoder.embed([crop]) for crop in crops])
    return Stream(
        np.array([truth for _, truth in shown], np.object_),
        _objects([gallery.match(embedding) for embedding in embeddings]),
        embeddings,
        np.array([_size(frame) for frame, _ in shown], np.float32),
        np.array([_sharpness(crop) for crop in crops], np.float32),
        np.array(list(_changes(crops))),
    )


def _objects(looks: Sequence[Evidence]) -> NDArray[np.object_]:
    """Make an array of looks; numpy would take a list of them apart."""
    found = np.empty(len(looks), np.object_)
    found[:] = looks
    return found


def _changes(crops: Sequence[pictures.Crop]) -> Iterator[bool]:
    before: Floats | None = None
    for crop in crops:
        after = pictures.signature(crop)
        is_new = before is None or pictures.has_changed(before, after)
        before = after if is_new else before
        yield is_new


def _size(frame: Frame) -> float:
    from PIL import Image

    if frame.mask is None:
        region = frame.region
        share = region.w * region.h if region else pictures.CENTRE**2
        return float(np.sqrt(share * frame.width * frame.height))
    with Image.open(BytesIO(frame.mask)) as mask:
        return float(np.sqrt((np.asarray(mask) > 0).sum()))


def _sharpness(crop: pictures.Crop) -> float:
    grey, inside = crop.image.mean(axis=2), crop.mask[1:, 1:] > 0
    steps = np.hypot(np.diff(grey, axis=0)[:, 1:], np.diff(grey, axis=1)[1:])
    return float(steps[inside].mean()) if inside.any() else 0.0
