"""The graph of the shipped encoder: its features are read, and its head is replaced.

The network in it is frozen: the Lite0 of Tan and Le's EfficientNet with Google's weights, folded
and rounded to int8. The map of each of six stages is averaged under the mask, which gives mean and
standard deviation of each channel; the last map gives its mean, and the scores of ImageNet's
classes. The head standardises these numbers, and one hidden layer turns them into an embedding.
LOG.md names the commit whose code made the network's part from Google's weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray

from hapticvlm.vision.encoders import joint_embedding

STAGES = (24, 40, 80, 112, 192, 320)  # channels of the maps with mean and standard deviation
LAST = 1280  # channels of the last map
FEATURES = 2 * sum(STAGES) + LAST

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Head:
    """Features (N, F), standardised and of unit norm, to one hidden layer of W, of unit norm.

    mean and scale (F,); weights (F, W) int8 with a step for each column, and bias (W,).
    """

    mean: Floats
    scale: Floats
    weights: NDArray[np.int8]
    steps: Floats
    bias: Floats

    @property
    def dimension(self) -> int:
        """Length of an embedding."""
        return len(self.bias) + joint_embedding.ADDED


def describing(graph: bytes) -> bytes:
    """Return the graph with outputs "features" (N, FEATURES) and "_fc", the scores (N, 1000)."""
    model = onnx.load_model_from_string(graph)
    del model.graph.output[:]
    for name, count in (("features", FEATURES), ("_fc", joint_embedding.CLASSES)):
        kind = onnx.TensorProto.FLOAT
        model.graph.output.append(onnx.helper.make_tensor_value_info(name, kind, ["N", count]))
    data: bytes = model.SerializeToString()
    return data


def with_head(graph: bytes, head: Head) -> bytes:
    """Return the graph with another head, and the materials of classes as they are now."""
    model = onnx.load_model_from_string(graph)
    tensors: dict[str, NDArray[Any]] = {
        "head.mean": head.mean,
        "head.scale": head.scale,
        "head.whole.stored": head.weights,
        "head.steps": head.steps,
        "head.bias": head.bias,
        "materials.stored": joint_embedding.material_weights().astype(np.float16),
    }
    for tensor in model.graph.initializer:
        if tensor.name in tensors:
            value = tensors.pop(tensor.name)
            tensor.CopyFrom(onnx.numpy_helper.from_array(value, tensor.name))
    if tensors:
        raise ValueError(f"the graph has no {', '.join(tensors)}")
    model.graph.output[0].type.tensor_type.shape.dim[1].dim_value = head.dimension
    data: bytes = model.SerializeToString()
    return data
