"""Caches the tables that the engine computes before its first block in the user's cache folder.

The name of the file is a hash of what its contents depend on: the code that computes them and the
version of numpy. So a newer program never reads an older one's numbers, and a file never has to be
marked as out of date. If the file is missing or damaged, the engine computes the tables again.
"""

from __future__ import annotations

import hashlib
import logging
import zlib
from pathlib import Path
from types import ModuleType

import msgspec
import numpy as np

from hapticvlm import documents, perception
from hapticvlm.cache_folder import cache_folder
from hapticvlm.rendering.vibration import impacts, loops, perceived_level
from hapticvlm.rendering.vibration.cache import ArrayCache, Doubles

MAX_BYTES = 64 * documents.MIB
_COMPUTED_BY: tuple[ModuleType, ...] = (impacts, loops, perceived_level, perception)
_SUM_BYTES = 4

logger = logging.getLogger(__name__)


def load(cache: ArrayCache, folder: Path | None = None) -> None:
    """Fill the cache from the file of an earlier run, if there is a valid one."""
    try:
        data = documents.read_bytes(_file(folder), MAX_BYTES)
        cache.fill(_unpacked(data))
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        logger.info("ignoring the cached tables, recomputing them: %s", error)


def save(cache: ArrayCache, folder: Path | None = None) -> None:
    """Save the cache for the next run if anything in it is new; remove files of other versions."""
    if not cache.computed:
        return
    try:
        file = _file(folder)
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        documents.replace_file(file, _packed(cache.arrays()), 0o600)
        for old in set(file.parent.glob("vibration-*.bin")) - {file}:
            old.unlink(missing_ok=True)
    except OSError as error:
        logger.info("cannot save the computed tables, the next start recomputes them: %s", error)


def _file(folder: Path | None) -> Path:
    digest = hashlib.sha256(np.__version__.encode())
    for module in _COMPUTED_BY:
        digest.update(Path(str(module.__file__)).read_bytes())
    return (folder or cache_folder()) / f"vibration-{digest.hexdigest()[:16]}.bin"


def _packed(arrays: dict[str, Doubles]) -> bytes:
    body = msgspec.msgpack.encode({name: array.tobytes() for name, array in arrays.items()})
    return zlib.crc32(body).to_bytes(_SUM_BYTES, "little") + body


def _unpacked(data: bytes) -> dict[str, Doubles]:
    """Return the arrays in the bytes of a cache file. Raises ValueError."""
    body = memoryview(data)[_SUM_BYTES:]
    if zlib.crc32(body) != int.from_bytes(data[:_SUM_BYTES], "little"):
        raise ValueError("the file is damaged")
    contents = msgspec.msgpack.decode(body, type=dict[str, bytes])
    return {name: np.frombuffer(array, np.float64) for name, array in contents.items()}
