"""Reads and writes galleries: a .npz file, or a folder with one and the user's materials.

A file holds encoder, materials, references, labels and calibration, and optionally a linear layer,
one for pictures of flat colours (`flat_layer`), one for texture maps (`texture_layer`), the picture
of each reference (`places`), and user references with the same keys under `own_`. User references
are calibrated again, by leaving each picture out, whenever a gallery is loaded.
"""

from __future__ import annotations

import logging
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import astuple, replace
from io import BytesIO
from pathlib import Path
from tokenize import TokenError
from zipfile import BadZipFile, ZipFile

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.encoders import encoder as encoders
from hapticvlm.vision.encoders.encoder import Encoder, NetworkEncoder
from hapticvlm.vision.encoders.file_encoder import USUAL, FileEncoder
from hapticvlm.vision.encoders.onnx_encoder import shipped_folder
from hapticvlm.vision.encoders.preprocessing import PREPROCESSING
from hapticvlm.vision.galleries.calibration import calibrate
from hapticvlm.vision.galleries.gallery import (
    MAX_SHARPNESS,
    Calibration,
    Gallery,
    LinearLayer,
    join,
)
from hapticvlm.vision.galleries.network_gallery import cached_gallery, make_gallery, trial_shares
from hapticvlm.vision.galleries.user_materials import (
    SHORTEST,
    UserMaterial,
    is_empty,
    read_folder,
    table_with,
)

FILE_NAME = "gallery.npz"  # in a gallery folder
SHIPPED = encoders.SHIPPED / encoders.DEFAULT / FILE_NAME
_USER = "own_"

MAX_FILE_BYTES = 512 * documents.MIB
MAX_UNPACKED_BYTES = 1024 * documents.MIB
# Raised by numpy and zipfile for a file of another format, or one that was tampered with.
_BROKEN = (
    EOFError,
    KeyError,
    ValueError,
    TypeError,
    BadZipFile,
    NotImplementedError,
    RuntimeError,
    TokenError,
    zlib.error,
    MemoryError,
)

logger = logging.getLogger(__name__)


class GalleryError(HapticVLMError):
    """A gallery cannot be used; the message says why and how to fix it."""


def save_gallery(gallery: Gallery, path: Path) -> None:
    """Write a gallery to one .npz file, whole or not at all."""
    documents.replace_file(path, gallery_bytes(gallery))


def gallery_bytes(gallery: Gallery) -> bytes:
    """Return the bytes of a gallery's file; equal galleries give equal bytes."""
    arrays = {"encoder": np.array(gallery.encoder), **_arrays(gallery)}
    if gallery.user is not None:
        arrays |= {f"{_USER}{key}": value for key, value in _arrays(gallery.user).items()}
    data = BytesIO()
    np.savez(data, **arrays)  # type: ignore[arg-type]  # its stubs want a flag first
    return data.getvalue()


def load_gallery(
    path: Path | None = None,
    *,
    encoder: Encoder,
    user_materials: Sequence[UserMaterial] | None = None,
) -> Gallery:
    """Read a gallery (None: the shipped one) for one encoder. Raises GalleryError, MaterialError.

    A folder holds gallery.npz (if not, the shipped one is used) and the user's materials; pass
    `user_materials` if they have been read before. For a network that the user named, the shipped
    gallery is replaced by one made for it (network_gallery).
    """
    base = file_of(path)
    gallery = read_gallery(base)
    if base == SHIPPED and gallery.encoder != encoder.name:
        gallery = shipped_gallery(encoder) or gallery
    require_encoder(base, gallery.encoder, encoder)
    _require_dimension(base, gallery.references, encoder)
    if user_materials is None:
        user_materials = read_folder(path)
        require_some(path)
    known = {UNKNOWN, *table_with(user_materials)}
    for name in gallery.materials:
        if name not in known:
            problem = (
                f"{base} has references of `{name}`, which is not a material; put the file into"
            )
            raise GalleryError(f"{problem} a folder as {FILE_NAME}, with a {name}.toml beside it")
    for material in user_materials:
        if material.encoder is not None:
            file = (path or SHIPPED.parent) / f"{material.material.name}.toml"
            require_encoder(file, material.encoder, encoder)
            _require_dimension(file, material.references, encoder)
    return with_user_materials(gallery, user_materials)


def shipped_gallery(encoder: Encoder) -> Gallery | None:
    """Return the gallery that replaces the shipped one for this encoder; None if there is none.

    Each shipped encoder has one; for a network that the user named it is made on first use.
    """
    if (shipped := _shipped_file(encoder)) is not None:
        return read_gallery(shipped)
    return network_gallery(encoder) if isinstance(encoder, NetworkEncoder) else None


def is_shipped(encoder: Encoder) -> bool:
    """Whether references ship for an encoder."""
    return _shipped_file(encoder) is not None


def _shipped_file(encoder: Encoder) -> Path | None:
    folder = shipped_folder(encoder.name)
    return None if folder is None else folder / FILE_NAME


def network_gallery(encoder: NetworkEncoder) -> Gallery:
    """Read the gallery of a network from the user's cache; make it on first use."""
    path = cached_gallery(encoder)
    with suppress(GalleryError):
        return read_gallery(path)
    # The gallery is cached because embedding hundreds of pictures with a large network takes
    # minutes. The file's name depends on network and preprocessing, so galleries of different
    # networks are never confused. If the folder cannot be written, the gallery is used anyway and
    # made again at the next start. So is that of a network that hardly tells materials apart, for
    # its warning to be seen at each start.
    fit = make_gallery(encoder)
    if not fit.tells_materials:
        return fit.gallery
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_gallery(fit.gallery, path)
    except OSError as error:
        logger.warning("cannot cache the gallery of `%s` (%s)", encoder.name, error)
    return fit.gallery


def best_prepared(encoder: FileEncoder) -> FileEncoder:
    """Return a network whose preparation nothing states with the usual one that fits best.

    Its gallery is kept, so the usual ones are tried once.
    """
    trials = [encoder.prepared(usual) for usual in encoder.preparations]
    kept = [trial for trial in trials if cached_gallery(trial).is_file()]
    if kept:
        return kept[0]
    shares = trial_shares(trials)
    tried = ", ".join(f"{way} {share:.0%}" for way, share in zip(USUAL, shares, strict=True))
    best = int(np.argmax(shares))
    message = "encoder `%s`: no %s beside it; levels are prepared as %s (right: %s)"
    logger.warning(message, encoder.name, PREPROCESSING[0], list(USUAL)[best], tried)
    network_gallery(trials[best])
    return trials[best]


def require_some(path: Path | None) -> None:
    """Refuse an empty folder, for which the shipped references would be used unasked."""
    if is_empty(path):
        cure = "`hapticvlm gallery build` or `add` makes a gallery"
        raise GalleryError(f"{path}: holds no reference pictures ({FILE_NAME} or a .toml); {cure}")


def file_of(path: Path | None) -> Path:
    """Return the file with the references of a gallery given as file, folder or None (shipped)."""
    if path is None or (path.is_dir() and not (path / FILE_NAME).exists()):
        return SHIPPED
    return path / FILE_NAME if path.is_dir() else path


def read_gallery(path: Path) -> Gallery:
    """Read one .npz file, whichever encoder it was made with. Raises GalleryError."""
    try:
        # A gallery may come from anybody. Its size is checked before it is read, and its unpacked
        # size before it is unpacked; numpy reads no pickles. Then each array is checked against the
        # others.
        data = documents.read_bytes(path, MAX_FILE_BYTES)
        arrays = _unpacked(data)
        encoder = str(arrays["encoder"])
        gallery = _parse(path, encoder, arrays)
        if f"{_USER}references" in arrays:
            user = {key.removeprefix(_USER): arrays[key] for key in arrays if key.startswith(_USER)}
            gallery = replace(gallery, user=_parse(path, encoder, user))
    except OSError as error:
        reason = error.strerror or str(error)
        raise GalleryError(f"{path}: not a gallery ({reason}); name one, or build it") from None
    except _BROKEN as error:
        raise GalleryError(
            f"{path}: not a gallery ({documents.reason(error)}); build it again"
        ) from None
    return gallery


def _unpacked(data: bytes) -> dict[str, NDArray[np.generic]]:
    """Return the arrays of an .npz file. Raises ValueError."""
    try:
        _check_unpacked_size(data)
        with np.load(BytesIO(data), allow_pickle=False) as file:
            return {key: file[key] for key in file.files}
    except _TooLargeError:
        raise
    except _BROKEN:
        raise ValueError("no .npz file of numbers, or a damaged one") from None


class _TooLargeError(ValueError):
    """The declared unpacked size exceeds any gallery's."""


def _check_unpacked_size(data: bytes) -> None:
    """Refuse a file whose declared unpacked size exceeds any gallery's. Raises _TooLargeError."""
    with ZipFile(BytesIO(data)) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
    if unpacked > MAX_UNPACKED_BYTES:
        raise _TooLargeError(
            f"it unpacks to {unpacked} bytes; at most {MAX_UNPACKED_BYTES} are read"
        )


def require_encoder(path: Path, made_with: str, encoder: Encoder) -> None:
    """Refuse references made with another encoder. Raises GalleryError naming both."""
    if made_with != encoder.name:
        problem = f"{path} was made with encoder `{made_with}`, not `{encoder.name}`"
        raise GalleryError(
            f"{problem}; build it again from its pictures: hapticvlm gallery build, or gallery add"
        )


def _arrays(gallery: Gallery) -> dict[str, NDArray[np.generic]]:
    arrays: dict[str, NDArray[np.generic]] = {
        "materials": np.array(gallery.materials),
        "references": gallery.references.astype(np.float16),
        "labels": gallery.labels.astype(np.int64),
        "calibration": np.array(astuple(gallery.calibration)),
    }
    if gallery.places is not None:
        arrays["places"] = gallery.places.astype(np.int64)
    if gallery.layer is not None:
        arrays["layer"] = _rows(gallery.layer).astype(np.float32)
    further = {"flat_layer": gallery.flat_layer, "texture_layer": gallery.texture_layer}
    for name, layer in further.items():
        if layer is not None:
            arrays[name] = _rows(layer).astype(np.float16)  # half the bytes do
    return arrays


def _rows(layer: LinearLayer) -> NDArray[np.float32]:
    return np.vstack([layer.weights, layer.bias])


def _parse(path: Path, encoder: str, arrays: Mapping[str, NDArray[np.generic]]) -> Gallery:
    names = tuple(str(name) for name in arrays["materials"])
    references = arrays["references"].astype(np.float32)
    labels = arrays["labels"].astype(np.int64)
    calibration = Calibration(*(float(number) for number in arrays["calibration"].tolist()))
    _require_whole(path, references, labels, names)
    is_sharp = 0.0 < calibration.sharpness <= MAX_SHARPNESS
    if not is_sharp or not np.isfinite(astuple(calibration)).all():
        raise GalleryError(f"{path}: its calibration is broken; build it again")
    norms = np.linalg.norm(references, axis=1, keepdims=True)
    layer, flat_layer, texture_layer = (
        _layer(path, arrays[name].astype(np.float32), references, names) if name in arrays else None
        for name in ("layer", "flat_layer", "texture_layer")
    )
    places = arrays["places"].astype(np.int64) if "places" in arrays else None
    if places is not None and places.shape != labels.shape:
        raise GalleryError(f"{path}: {places.size} places for {labels.size} labels; build it again")
    unit = np.asarray(references / norms, np.float32)
    return Gallery(
        encoder,
        names,
        unit,
        labels,
        calibration,
        layer,
        places=places,
        flat_layer=flat_layer,
        texture_layer=texture_layer,
    )


def _layer(
    path: Path, rows: NDArray[np.float32], references: NDArray[np.float32], names: Sequence[str]
) -> LinearLayer:
    expected = (references.shape[1] + 1, len(names))
    if rows.shape != expected or not np.isfinite(rows).all():
        problem = f"its linear layer has shape {rows.shape}, not {expected}, or is not finite"
        raise GalleryError(f"{path}: {problem}; build it again")
    return LinearLayer(rows[:-1], rows[-1])


def _require_dimension(path: Path, references: NDArray[np.float32], encoder: Encoder) -> None:
    if references.shape[1] != encoder.dimension:
        problem = f"{path}: references of {references.shape[1]} numbers, but `{encoder.name}` gives"
        raise GalleryError(f"{problem} {encoder.dimension}; build it again")


def _require_whole(
    path: Path, references: NDArray[np.float32], labels: NDArray[np.int64], names: Sequence[str]
) -> None:
    if references.ndim != 2 or labels.shape != references.shape[:1]:
        problem = f"references of shape {references.shape} with {labels.size} labels"
        raise GalleryError(f"{path}: {problem}; build it again")
    if (
        not (np.linalg.norm(references, axis=1) > SHORTEST).all()
        or not np.isfinite(references).all()
    ):
        raise GalleryError(f"{path}: references that are not of unit length; build it again")
    if sorted(set(labels.tolist())) != list(range(len(names))) or len(set(names)) != len(names):
        raise GalleryError(f"{path}: every material needs a reference; build it again")


def with_user_materials(gallery: Gallery, added: Sequence[UserMaterial]) -> Gallery:
    """Add user materials to a gallery's user references, and calibrate these again."""
    parents = {material.material.name: material.like for material in added}
    gallery = replace(gallery, parents={**gallery.parents, **parents})
    parts = [_references_of(material, gallery) for material in added if material.encoder]
    if gallery.layer is None and gallery.user is None and gallery.places is not None:
        whole = replace(join([gallery, *parts]), parents=gallery.parents)
        # A gallery that a user built has no layer and knows its pictures. Added references join it
        # as if all had been enrolled together, with one calibration. Any other gallery stays as it
        # is, and the user references form a second one beside it.
        return replace(whole, calibration=calibrate(whole)) if added else gallery
    galleries = [part for part in (gallery.user, *parts) if part is not None]
    if not galleries:
        return gallery
    joined = join(galleries)
    return replace(gallery, user=replace(joined, calibration=calibrate(joined, gallery)))


def _references_of(material: UserMaterial, gallery: Gallery) -> Gallery:
    pictures = material.pictures or (1,) * len(material.references)
    return Gallery(
        gallery.encoder,
        (material.material.name,),
        material.references,
        np.zeros(len(material.references), np.int64),
        gallery.calibration,
        places=np.repeat(np.arange(len(pictures)), pictures),
    )
