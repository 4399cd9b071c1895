"""The arrays of a torch file in its older, unzipped format, read without torch and without trust.

Such a file is five pickles (a magic number, the version 1001, what the machine was like, the
tensors by name, the keys of their storages) and then, for each storage, its length and its raw
numbers. A pickle may name any function of any package and have it called. Here it may name four,
and what these four give is plain data; any other name is refused before it is looked up. Every
length, offset and stride is checked against the bytes that are there, so that no view can leave
its storage. numpy only.
"""

from __future__ import annotations

import io
import math
import pickle
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.generic]

MAGIC = 0x1950A86A20F9469CFC6C
VERSION = 1001
KINDS: Mapping[str, np.dtype[Any]] = {
    "FloatStorage": np.dtype("<f4"),
    "LongStorage": np.dtype("<i8"),
}
MOST_BYTES = 64 * 2**20  # of a file; the largest network that is read here has 25 million
MOST_PICKLED = 2**20  # of a pickle, which names the tensors and does not hold them
MOST_DIMENSIONS = 4  # of a tensor: the weights of a convolution
_LENGTH = 8  # bytes before the numbers of a storage that say how many these are


class TorchFileError(ValueError):
    """A file that is not a torch file of this format, or that asks for more than numbers."""


@dataclass(frozen=True, slots=True)
class _Storage:
    """A storage that a pickle names: its key in the file, the kind of its numbers, how many."""

    key: str
    kind: np.dtype[np.float32] | np.dtype[np.int64]
    count: int


@dataclass(frozen=True, slots=True)
class _Tensor:
    """A view of a storage as a pickle describes it; nothing of it has been checked."""

    storage: object
    offset: object
    shape: object
    strides: object


def _rebuild(storage: object, offset: object, shape: object, strides: object, *_: object) -> object:
    return _Tensor(storage, offset, shape, strides)


class _Unpickler(pickle.Unpickler):
    """Knows the four names of a file of weights."""

    def find_class(self, module: str, name: str) -> Any:  # noqa: ANN401 - as pickle declares it
        # Whatever a pickle calls, it must have found here. OrderedDict makes a dict, `_rebuild` a
        # record, and a `_Kind` cannot be called at all. Nothing that is found can open a file,
        # import a module or run a text, and looking up any other name ends the reading before the
        # name is imported.
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _rebuild
        if module == "torch" and name in KINDS:
            return _Kind(name)
        raise TorchFileError(f"it names {module[:40]}.{name[:40]}, which weights do not need")

    def persistent_load(self, pid: Any) -> _Storage:  # noqa: ANN401 - as pickle declares it
        is_storage = isinstance(pid, tuple) and len(pid) >= 5 and pid[0] == "storage"
        if not is_storage or not isinstance(pid[1], _Kind) or not isinstance(pid[2], str):
            raise TorchFileError("it refers to something that is no storage")
        if not _is_count(pid[4]):
            raise TorchFileError("a storage has no length")
        return _Storage(pid[2], KINDS[pid[1].name], pid[4])


@dataclass(frozen=True, slots=True)
class _Kind:
    """Stands for the class of a storage; it cannot be called."""

    name: str


def read_arrays(data: bytes) -> Mapping[str, Array]:
    """Return the arrays of a file by name, each a view that cannot be written to.

    Raises TorchFileError.
    """
    if len(data) > MOST_BYTES:
        raise TorchFileError(f"it has {len(data)} bytes, at most {MOST_BYTES} are read")
    file = io.BytesIO(data)
    if _unpickle(file) != MAGIC or _unpickle(file) != VERSION:
        raise TorchFileError("it is not in the older format of torch")
    machine = _unpickle(file)
    if not isinstance(machine, dict) or machine.get("little_endian") is not True:
        raise TorchFileError("its numbers are not little-endian")
    tensors = _unpickle(file)
    keys = _unpickle(file)
    if not isinstance(tensors, dict) or not isinstance(keys, list):
        raise TorchFileError("it holds no tensors by name")
    storages = _read_storages(file, tensors, keys)
    return {str(name): _view(str(name), found, storages) for name, found in tensors.items()}


def _unpickle(file: io.BytesIO) -> object:
    """Read one pickle. Whatever a broken one trips in pickle is a TorchFileError."""
    start = file.tell()
    window = io.BytesIO(file.getvalue()[start : start + MOST_PICKLED])
    try:
        found: object = _Unpickler(window).load()
    except TorchFileError:
        raise
    except Exception as error:  # noqa: BLE001 - pickle raises what its input makes it meet
        raise TorchFileError(f"a pickle in it is broken ({type(error).__name__})") from None
    file.seek(start + window.tell())
    return found


def _read_storages(
    file: io.BytesIO, tensors: Mapping[object, object], keys: list[object]
) -> dict[str, Array]:
    """Read the numbers of each storage, in the order of `keys`."""
    used = [found.storage for found in tensors.values() if isinstance(found, _Tensor)]
    named = {storage.key: storage for storage in used if isinstance(storage, _Storage)}
    storages: dict[str, Array] = {}
    for key in keys:
        storage = named.get(key) if isinstance(key, str) else None
        if storage is None:
            raise TorchFileError("it has a storage that no tensor uses")
        # Each length stands in the file twice, in the pickle and before the numbers. Both must
        # agree before as many bytes are asked for: a length that lies would otherwise shift all
        # storages behind it.
        if int.from_bytes(file.read(_LENGTH), "little") != storage.count:
            raise TorchFileError(f"storage {storage.key[:40]} has another length than it says")
        content = file.read(storage.count * storage.kind.itemsize)
        if len(content) != storage.count * storage.kind.itemsize:
            raise TorchFileError("it ends before its numbers do")
        storages[storage.key] = np.frombuffer(content, storage.kind)
    return storages


def _view(name: str, tensor: object, storages: Mapping[str, Array]) -> Array:
    """Return a tensor as a strided view of its storage, once that is known to hold all of it."""
    if not isinstance(tensor, _Tensor) or not isinstance(tensor.storage, _Storage):
        raise TorchFileError(f"{name[:60]} is no tensor")
    shape = _counts(name, tensor.shape)
    strides = _counts(name, tensor.strides)
    storage = storages.get(tensor.storage.key)
    if storage is None or len(shape) != len(strides) or not _is_count(tensor.offset):
        raise TorchFileError(f"{name[:60]} has no storage, or strides of another tensor")
    # `as_strided` believes what it is told and would read outside its buffer. All counts are known
    # not to be negative, so the last element lies furthest; if it is inside, all are. The product
    # of the shape is compared, too: strides of 0 would repeat one number into a tensor of any size.
    last = sum((size - 1) * stride for size, stride in zip(shape, strides, strict=True))
    if 0 in shape or math.prod(shape) > storage.size or tensor.offset + last >= storage.size:
        raise TorchFileError(f"{name[:60]} leaves its storage")
    steps = [stride * storage.itemsize for stride in strides]
    return np.lib.stride_tricks.as_strided(storage[tensor.offset :], shape, steps, writeable=False)


def _counts(name: str, given: object) -> tuple[int, ...]:
    if isinstance(given, tuple) and len(given) <= MOST_DIMENSIONS and all(map(_is_count, given)):
        return given
    raise TorchFileError(f"{name[:60]} has a shape or strides that are no counts")


def _is_count(given: object) -> TypeGuard[int]:
    return type(given) is int and 0 <= given <= MOST_BYTES
