"""Held-back pictures, one `Source` per origin; sources are never mixed.

A source is a capture (frames with object id, truth, mask) or a set of labelled photographs. A limit
keeps the same pictures each time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Literal
from zlib import crc32

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.demo import CAPTURE
from hapticvlm.vision.pictures import Crop, crop

Cut = Literal["mask", "centre", "whole"]

FOUR = ("wood", "glass", "fabric", "metal")
# The data folder, where it lies beside a checkout.
SIBLING = Path(__file__).parents[5] / "shared" / "data"
VIEWS = 8  # most views used per object, evenly over its time


@dataclass(frozen=True, slots=True)
class View:
    """One picture of one object: the encoded frame, its truth, and its mask if known."""

    frame: messages.Frame
    object_id: str
    truth: str
    mask: bytes | None = None

    def as_cut(self, cut: Cut) -> messages.Frame:
        """Return the frame as sent by a client that knows the mask, the whole frame, or neither."""
        mask = self.mask if cut == "mask" else None
        region = messages.WHOLE if cut == "whole" else None
        return msgspec.structs.replace(self.frame, mask=mask, region=region)


@dataclass(frozen=True, slots=True)
class Stated:
    """The scene's statements about an object, without its material.

    `surface`: the name of its largest surface. `texture`: the base-colour map of that.
    """

    name: str | None = None
    shader: messages.Shader | None = None
    surface: str | None = None
    texture: messages.Frame | None = field(default=None, repr=False)


@dataclass(frozen=True, eq=False)
class Source:
    """Views of one origin, those of an object together and in order of time."""

    name: str
    views: tuple[View, ...]
    stated: Mapping[str, Stated] = field(default_factory=dict)
    note: str = ""

    @property
    def cut(self) -> Cut:
        """The cut of the objects, unless a method has its own."""
        return "mask" if all(view.mask is not None for view in self.views) else "whole"

    @property
    def truth(self) -> NDArray[np.str_]:
        """(N,) materials."""
        return np.array([view.truth for view in self.views])

    @property
    def objects(self) -> NDArray[np.str_]:
        """(N,) object ids."""
        return np.array([view.object_id for view in self.views])

    def keep(self, classes: Collection[str]) -> Source:
        """Drop the views of other classes."""
        views = tuple(view for view in self.views if view.truth in classes)
        return Source(self.name, views, self.stated, self.note)


@dataclass(frozen=True, slots=True)
class Where:
    """Folders of pictures, and the number of views used of each source (0: all)."""

    data: Path | None
    limit: int
    capture: Path = CAPTURE


@lru_cache(maxsize=6)
def crops(source: Source, cut: Cut, side: int) -> tuple[Crop, ...]:
    """Cut every view with the product's own `crop`. Raises PictureError."""
    return tuple(crop(view.as_cut(cut), side) for view in source.views)


def thin(source: Source, limit: int, per_object: int = VIEWS) -> Source:
    """Keep at most `limit` views (0: all objects): classes equally, objects whole, repeatably.

    Objects are taken in the order of a checksum of their id, so that a larger limit only adds.
    """
    groups = by_object(source.views)
    kept = {key: _spread(group, per_object) for key, group in groups.items()}
    by_class: dict[str, list[str]] = defaultdict(list)
    for key in sorted(kept, key=shuffled):
        by_class[kept[key][0].truth].append(key)
    chosen: set[str] = set()
    budget = limit or len(source.views)
    for rank in range(max(map(len, by_class.values()), default=0)):
        layer = [keys[rank] for keys in by_class.values() if rank < len(keys)]
        budget -= sum(len(kept[key]) for key in layer)
        if budget < 0 and chosen:
            break
        chosen.update(layer)
    views = tuple(view for key, group in kept.items() if key in chosen for view in group)
    return Source(source.name, views, source.stated, source.note)


def by_object(views: Iterable[View]) -> dict[str, list[View]]:
    """Group views by object, each group in the order of the argument."""
    groups: dict[str, list[View]] = defaultdict(list)
    for view in views:
        groups[view.object_id].append(view)
    return groups


def _spread(views: Sequence[View], count: int) -> list[View]:
    at = np.linspace(0, len(views) - 1, min(count, len(views))).round().astype(int)
    return [views[index] for index in at]


def shuffled(key: str) -> tuple[int, str]:
    """Return a sort key whose order is repeatable but not alphabetic."""
    return crc32(key.encode()), key
