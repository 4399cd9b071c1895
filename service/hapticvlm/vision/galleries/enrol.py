"""Turns a user's pictures into references: finds them in folders, cuts, varies, embeds them.

Each picture gives several references, because users have few pictures: the object as a frame would
show it, its mirror image, and two closer views. A thing on a plain ground is outlined, as if it had
a mask, since a scene sends its objects with one. Copies of a picture count once. Knows no gallery
and no calibration.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.errors import HapticVLMError, why_no_folder
from hapticvlm.materials import nearest
from hapticvlm.vision import files, pictures, plain_ground
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.pictures import Crop, PictureError

Floats = NDArray[np.float32]

MASK = ".mask"  # NAME.mask.png beside NAME.jpg, or masks/NAME.png
CLOSER = (0.8, 0.6)  # of the object's box: the scales of the further views
BLANK = 1.0  # grey levels, standard deviation; a crop that varies less shows nothing

logger = logging.getLogger(__name__)


class EnrolError(HapticVLMError, ValueError):
    """Pictures cannot be used; the message names the file, the reason and the cure."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A file that shows one material, under the mask or, without one, in its centre."""

    material: str
    path: Path
    mask: Path | None = None


@dataclass(frozen=True, slots=True)
class Enrolled:
    """References of P pictures: embeddings (N, D) float32 of unit norm.

    places: (N,), the index in `pictures` of each row. A picture's first row is the object as a
    frame would show it, the others are its variations. outlined: the pictures of a thing on a plain
    ground. flat: whether each picture's first view has flat colours, (P,); () if unknown.
    """

    pictures: tuple[Picture, ...]
    embeddings: Floats
    places: NDArray[np.int64]
    outlined: int = 0
    flat: tuple[bool, ...] = ()

    @property
    def materials(self) -> tuple[str, ...]:
        """The materials of the pictures, in their order."""
        return tuple(dict.fromkeys(picture.material for picture in self.pictures))

    @property
    def labels(self) -> NDArray[np.int64]:
        """The index in `materials` of each picture, (P,)."""
        names = self.materials
        return np.array([names.index(picture.material) for picture in self.pictures], np.int64)

    @property
    def firsts(self) -> NDArray[np.int64]:
        """The row of each picture's unvaried view, (P,)."""
        return np.searchsorted(self.places, np.arange(len(self.pictures)))

    def references(self, material: str) -> Floats:
        """Return all rows of one material, (n, D)."""
        chosen = np.array([picture.material == material for picture in self.pictures])
        return np.asarray(self.embeddings[chosen[self.places]])


def find_pictures(folder: Path, known: Collection[str]) -> tuple[Picture, ...]:
    """List FOLDER/<material>/* with their masks, in order of name. Raises EnrolError."""
    if not folder.is_dir():
        raise EnrolError(f"{why_no_folder(folder)}; name one with a folder for each material")
    for path in _pictures_in(folder):
        raise EnrolError(f"{path}: not in a material's folder; move it into one")
    pictures: list[Picture] = []
    for inner in sorted(path for path in folder.iterdir() if path.is_dir() and _is_visible(path)):
        if inner.name not in known:
            problem = f"{inner}: `{inner.name}` is not a material{nearest(inner.name, known)}"
            raise EnrolError(f"{problem}; rename it, or add it: gallery add")
        pictures += with_masks(inner.name, _require_some(inner))
    if not pictures:
        raise EnrolError(f"{folder}: holds no folders of pictures; make one for each material")
    return tuple(pictures)


def list_pictures(material: str, paths: Iterable[Path]) -> tuple[Picture, ...]:
    """List files, and folders of files, that show one material. Raises EnrolError."""
    files = [file for path in paths for file in (_require_some(path) if path.is_dir() else [path])]
    return tuple(with_masks(material, files))


def with_masks(material: str, files: Sequence[Path]) -> list[Picture]:
    """Find the mask of each file, if it has one."""
    pictures = []
    for file in files:
        masks = (file.parent / "masks" / f"{file.stem}.png", file.with_suffix(f"{MASK}.png"))
        pictures.append(Picture(material, file, next((m for m in masks if m.is_file()), None)))
    return pictures


def enrol(chosen: Sequence[Picture], encoder: Encoder, *, outline: bool = True) -> Enrolled:
    """Cut, vary and embed pictures; copies of one count once. Raises EnrolError.

    `outline`: a thing on a plain ground is cut out as if it had a mask.
    """
    kept: list[Picture] = []
    rows: list[Floats] = []
    places: list[int] = []
    outlined = 0
    flat: list[bool] = []
    for picture, whole in _without_copies(chosen):
        thing = frames_of(picture, whole)[-1] if outline else whole
        outlined += thing is not whole
        crops = views(picture, thing, encoder.side)
        places += [len(kept)] * len(crops)
        kept.append(picture)
        flat.append(is_flat(crops[0]))
        # One at a time, as the service does: an int8 network's scale depends on the whole batch.
        rows.append(np.concatenate([encoder.embed([view]) for view in crops]))
        if not np.isfinite(rows[-1]).all() or not rows[-1].any(axis=1).all():
            problem = f"`{encoder.name}` gives it no usable embedding; remove it"
            raise EnrolError(f"{picture.path}: {problem}")
    stack = np.concatenate(rows) if rows else np.zeros((0, encoder.dimension), np.float32)
    return Enrolled(tuple(kept), stack, np.array(places, np.int64), outlined, tuple(flat))


def views(picture: Picture, frame: messages.Frame, side: int) -> list[Crop]:
    """Cut the object, its mirror image and closer views, each (side, side). Raises EnrolError."""
    try:
        first = pictures.crop(frame, side)
    except PictureError as error:
        raise EnrolError(f"{_culprit(picture, error)}: {_reason(error)}") from None
    if first.image.std(axis=(0, 1)).max() < BLANK:
        raise EnrolError(f"{picture.path}: one plain colour, which shows no material; remove it")
    # A user has a few pictures where a network learns from thousands. Variations that a scene is
    # sure to show stand in for more of them: the object mirrored, and seen from nearer by.
    crops = [first, _mirrored(first)]
    for scale in CLOSER:
        region = _closer(frame, scale)
        try:
            crops.append(pictures.crop(msgspec.structs.replace(frame, region=region), side))
        except PictureError:  # no part of the object is there: the middle of a ring
            continue
    return crops


def read_frame(picture: Picture) -> messages.Frame:
    """Read a picture's file, and its mask, as the frame a scene would send. Raises EnrolError."""
    try:
        return files.read_frame(picture.path, picture.mask)
    except files.FileError as error:
        raise EnrolError(f"{error}; replace it or remove it") from None


def frames_of(picture: Picture, frame: messages.Frame) -> list[messages.Frame]:
    """Return a picture's frame, then the outlined one if any (plain_ground). Raises EnrolError."""
    try:
        return plain_ground.views(frame)
    except PictureError as error:
        raise EnrolError(f"{_culprit(picture, error)}: {_reason(error)}") from None


def _without_copies(chosen: Sequence[Picture]) -> Iterator[tuple[Picture, messages.Frame]]:
    seen: set[tuple[str, bytes, bytes | None]] = set()
    for picture in chosen:
        frame = read_frame(picture)
        key = (picture.material, frame.image, frame.mask)
        if key not in seen:
            seen.add(key)
            yield picture, frame


def _closer(frame: messages.Frame, scale: float) -> messages.Region:
    """Return the middle of the object's box, `scale` of its sides."""
    x, y, w, h = _box(frame)
    gap = (1.0 - scale) / 2
    return messages.Region(x=x + gap * w, y=y + gap * h, w=scale * w, h=scale * h)


def _box(frame: messages.Frame) -> tuple[float, float, float, float]:
    """Return left, top, width and height of the mask or the region, as shares of the frame."""
    from PIL import Image

    if frame.mask is None:
        region = frame.region or pictures.CENTRE
        return region.x, region.y, region.w, region.h
    with Image.open(BytesIO(frame.mask)) as mask:
        left, top, right, bottom = mask.convert("L").getbbox() or (0, 0, *mask.size)
        w, h = mask.size
    return left / w, top / h, (right - left) / w, (bottom - top) / h


def _mirrored(crop: Crop) -> Crop:
    return Crop(np.ascontiguousarray(crop.image[:, ::-1]), np.ascontiguousarray(crop.mask[:, ::-1]))


def _require_some(folder: Path) -> list[Path]:
    pictures = _pictures_in(folder)
    others = files.left_out(folder)
    if not pictures:
        problem = f"{folder}: holds no JPEG, PNG or WebP" + (f" but {others}" if others else "")
        raise EnrolError(f"{problem}; add pictures or remove it")
    if others is not None:
        logger.warning("%s: left out: %s; save them as JPEG, PNG or WebP", folder, others)
    return pictures


def _pictures_in(folder: Path) -> list[Path]:
    return [path for path in files.list_files(folder) if not path.stem.endswith(MASK)]


def _is_visible(path: Path) -> bool:
    return not path.name.startswith(".")


def _culprit(picture: Picture, error: PictureError) -> Path:
    return picture.mask if picture.mask and error.path == "$.mask" else picture.path


def _reason(error: PictureError) -> str:
    return str(error).removeprefix(f"{error.path}: ")
