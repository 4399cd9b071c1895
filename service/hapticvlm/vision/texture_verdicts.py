"""Keeps what texture maps showed, by the hash of their bytes, in memory and in the cache folder.

Six windows take tens of milliseconds, and the maps of a scene are the same every day. The hash is
taken of the bytes that arrived: a client that misnames its maps deceives nobody but itself. The
file's name identifies encoder and layer, so a new version of either starts again. The file is
bounded, written whole or not at all, and can always be deleted.
"""

from __future__ import annotations

import hashlib
import logging
import math
from pathlib import Path

import msgspec

from hapticvlm import documents
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import Frame
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.galleries.gallery import Gallery

VERSION = 1  # of the windows and of this file
MOST = 2048  # verdicts; the one that was needed longest ago is dropped
MAX_BYTES = 4 * documents.MIB
_SUM_ERROR = 1e-6

Beliefs = tuple[tuple[str, float], ...]
logger = logging.getLogger(__name__)


class TextureVerdicts:
    """The verdicts of one encoder and layer; `path` None keeps them in memory alone."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._known = {} if path is None else _load(path)
        self._can_save = path is not None

    def get(self, key: str) -> Evidence | None:
        """Return what the map of this key showed, if it is known."""
        beliefs = self._known.pop(key, None)
        if beliefs is None:
            return None
        self._known[key] = beliefs  # the last one: it was needed now
        return Evidence("texture", beliefs)

    def put(self, key: str, evidence: Evidence) -> None:
        """Keep what a map showed, and save it; a disk that refuses is logged once."""
        self._known[key] = evidence.beliefs
        while len(self._known) > MOST:
            del self._known[next(iter(self._known))]
        if self._path is None or not self._can_save:
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            documents.replace_file(self._path, msgspec.msgpack.encode(self._known))
        except OSError as error:
            self._can_save = False
            logger.warning("verdicts on textures are not kept on disk: %s", error)


def key_of(frame: Frame) -> str:
    """Return 32 hexadecimal digits of all that the verdict on a map depends on."""
    digest = hashlib.blake2b(frame.image, digest_size=16)
    region = None if frame.region is None else msgspec.structs.astuple(frame.region)
    digest.update(repr((frame.format, frame.width, frame.height, frame.origin, region)).encode())
    return digest.hexdigest()


def file_name(encoder: Encoder, gallery: Gallery) -> str | None:
    """Return the name of the file of an encoder and gallery; None if they read no maps."""
    layer = gallery.texture_layer
    if layer is None:
        return None
    constants = (gallery.calibration.texture, gallery.calibration.even_slope)
    about = (VERSION, encoder.name, gallery.materials, *constants, gallery.calibration.even)
    digest = hashlib.blake2b(repr(about).encode(), digest_size=8)
    digest.update(layer.weights.tobytes())
    digest.update(layer.bias.tobytes())
    return f"textures-{digest.hexdigest()}.msgpack"


def _load(path: Path) -> dict[str, Beliefs]:
    """Read a file; one that is missing, damaged or of another format counts as empty."""
    try:
        data = documents.read_bytes(path, MAX_BYTES)
        known = msgspec.msgpack.decode(data, type=dict[str, Beliefs])
    except (OSError, ValueError, RecursionError):
        return {}
    return known if all(map(_is_sound, known.values())) else {}


def _is_sound(beliefs: Beliefs) -> bool:
    numbers = [belief for _, belief in beliefs]
    return all(number >= 0.0 for number in numbers) and math.fsum(numbers) <= 1.0 + _SUM_ERROR
