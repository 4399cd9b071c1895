"""The crops that simulated scenes send, and whether an answer is of the gallery it names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from hapticvlm import captures
from hapticvlm.messages import Frame
from hapticvlm.recogniser_app.galleries import Named
from hapticvlm.recognition import pictures
from hapticvlm.recognition.encoders.encoder import Encoder
from hapticvlm.recognition.pictures import Crop
from hapticvlm.recognition.remote.contract import Result

MOST = 64
BELIEF_ERROR = 1e-4  # of one embedding, on another processor


@dataclass(frozen=True, slots=True)
class RecordedCrops:
    """Crops in the order of the recording."""

    crops: tuple[Crop, ...]


def recorded(path: Path, encoder: Encoder) -> RecordedCrops:
    """Cut the objects out of MOST frames of a capture, evenly chosen. Raises CaptureError."""
    frames = [line for line in captures.read(path).lines() if line.type == "frame"]
    chosen = frames[:: max(1, len(frames) // MOST)][:MOST]
    crops = []
    for line in chosen:
        fields = {"type": "frame", "id": 1, "captured_at": line.t_s, **line.message()}
        frame = msgspec.convert(fields, Frame)
        crops.append(pictures.crop(frame, encoder.side))
    return RecordedCrops(tuple(crops))


class Truth:
    """The galleries by their hash: an answer is right if its own one gives it for its embedding."""

    def __init__(self, galleries: Sequence[Named]) -> None:
        self._galleries: Mapping[str, Named] = {named.identity.hash: named for named in galleries}

    def is_right(self, hash: str, result: Result) -> bool:
        """Whether the beliefs are those of the gallery with this hash, and of no other."""
        return [name for name, named in self._galleries.items() if _is_of(named, result)] == [hash]


def _is_of(named: Named, result: Result) -> bool:
    embedding = np.frombuffer(result.embedding, "<f4").astype(np.float32)
    wanted, given = dict(named.gallery.match(embedding).beliefs), dict(result.beliefs)
    return wanted.keys() == given.keys() and all(
        abs(wanted[name] - given[name]) <= BELIEF_ERROR for name in wanted
    )
