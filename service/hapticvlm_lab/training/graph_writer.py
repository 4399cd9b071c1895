"""Writes an ONNX graph node by node, quantised if the ranges of its activations are known.

Weights are named and left out until `filled` puts them in, because their rounding depends on the
scales that the graph settles. An activation is quantised to uint8 over the range that pictures gave
it: value = (level - zero) step. A node between two quantised tensors is then computed by
onnxruntime in whole numbers, which is several times as fast as floats.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from onnx import ModelProto, TensorProto, helper, numpy_helper

OPSET = 17
IR_VERSION = 8
LEVELS = 255
LEAST_RANGE = 1e-6

Ranges = Mapping[str, tuple[float, float]]  # least and greatest value of a tensor, by its name


@dataclass(slots=True)
class GraphWriter:
    """The nodes and constants so far.

    ranges: None for a graph of floats. `watched` are the tensors whose ranges a quantised graph
    needs; `scales` the step of each layer's input.
    """

    ranges: Ranges | None = None
    watched: list[str] = field(default_factory=list)
    scales: dict[str, float] = field(default_factory=dict)
    _nodes: list[Any] = field(default_factory=list)
    _constants: dict[str, Any] = field(default_factory=dict)
    _steps: dict[str, float] = field(default_factory=dict)

    def add(self, kind: str, inputs: Sequence[str], name: str, **attributes: Any) -> str:
        """Add a node with one output of the same name; return that name."""
        self._nodes.append(helper.make_node(kind, inputs, [name], name=name, **attributes))
        return name

    def has(self, name: str) -> bool:
        """Return whether a node of that name exists."""
        return any(node.name == name for node in self._nodes)

    def constant(self, name: str, value: ArrayLike) -> str:
        """Add a constant once; return its name."""
        self._constants.setdefault(name, numpy_helper.from_array(np.asarray(value), name))
        return name

    def folded(self, name: str, value: ArrayLike) -> str:
        """Add a constant that is stored in few bytes and cast to float32 when the graph opens."""
        stored = self.constant(f"{name}.stored", value)
        return self.add("Cast", [stored], name, to=TensorProto.FLOAT)

    def dequantised(self, x: str, name: str, step: float, zero: int) -> str:
        """Read uint8 as floats: (x - zero) step."""
        scale = self.constant(f"{name}.step", np.float32(step))
        origin = self.constant(f"{name}.zero", np.uint8(zero))
        self._steps[name] = float(np.float32(step))
        return self.add("DequantizeLinear", [x, scale, origin], name)

    def rounded(self, x: str, most: float | None = None) -> str:
        """Quantise an activation over its range, which begins at 0 if `most` is given.

        Saturation is then the rectifier: values below 0 or above `most` become 0 and `most`.
        """
        self.watched.append(x)
        if self.ranges is None:
            return x
        low, high = self.ranges[x]
        if most is not None:
            low = 0.0
            high = min(high, most)
        low = min(low, 0.0)
        high = max(high, LEAST_RANGE)
        # Zero must be a level of its own: padding and rectified cells are exactly 0, and an error
        # there would be added up over the whole map.
        step = float(np.float32((high - low) / LEVELS))
        scale = self.constant(f"{x}.rounded.step", np.float32(step))
        zero = round(-low / step)
        origin = self.constant(f"{x}.rounded.zero", np.uint8(zero))
        whole = self.add("QuantizeLinear", [x, scale, origin], f"{x}.whole")
        return self.dequantised(whole, f"{x}.rounded", step, zero)

    def layer(self, kind: str, x: str, name: str, shape: Sequence[int], **attributes: Any) -> str:
        """Add a convolution or a product whose weights (O, ...) and bias (O,) are left out."""
        if self.ranges is None:
            parts = [
                self._outside(f"{name}.weights", TensorProto.FLOAT, shape),
                self._outside(f"{name}.bias", TensorProto.FLOAT, shape[:1]),
            ]
            return self.add(kind, [x, *parts], name, **attributes)
        self.scales[name] = self._steps[x]
        weights = self._outside(f"{name}.weights", TensorProto.INT8, shape)
        bias = self._outside(f"{name}.bias", TensorProto.INT32, shape[:1])
        steps = self._outside(f"{name}.steps", TensorProto.FLOAT, shape[:1])
        unit = self._outside(f"{name}.unit", TensorProto.FLOAT, shape[:1])
        # Weights are int8 with a step for each output channel. The bias is int32 in units of input
        # step times weight step, so that it adds to the sum of products without rounding.
        zeros = np.zeros(shape[0])
        whole = self.constant(f"zeros8.{shape[0]}", zeros.astype(np.int8))
        wide = self.constant(f"zeros32.{shape[0]}", zeros.astype(np.int32))
        parts = [
            self.add("DequantizeLinear", [weights, steps, whole], f"{weights}.floats", axis=0),
            self.add("DequantizeLinear", [bias, unit, wide], f"{bias}.floats", axis=0),
        ]
        return self.add(kind, [x, *parts], name, **attributes)

    def model(
        self, side: int, outputs: Mapping[str, Sequence[int | str | None] | None]
    ) -> ModelProto:
        """Close the graph: crops (N, S, S, 4) uint8 to these float outputs, by name with shape."""
        shape: list[int | str | None] = ["N", side, side, 4]
        crops = helper.make_tensor_value_info("crops", TensorProto.UINT8, shape)
        results = [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, sizes)
            for name, sizes in outputs.items()
        ]
        constants = list(self._constants.values())
        graph = helper.make_graph(self._nodes, "encoder", [crops], results, constants)
        opsets = [helper.make_opsetid("", OPSET)]
        return helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)

    def _outside(self, name: str, kind: int, shape: Sequence[int]) -> str:
        tensor = TensorProto(name=name, data_type=kind, dims=shape)
        tensor.data_location = TensorProto.EXTERNAL
        entry = tensor.external_data.add()
        entry.key = "location"
        entry.value = "weights"
        self._constants[name] = tensor
        return name


def filled(model: ModelProto, tensors: Mapping[str, NDArray[np.generic]]) -> bytes:
    """Put every weight that was left out into a model. Raises KeyError for a missing one."""
    for tensor in model.graph.initializer:
        if tensor.data_location == TensorProto.EXTERNAL:
            tensor.CopyFrom(numpy_helper.from_array(tensors[tensor.name], tensor.name))
    data: bytes = model.SerializeToString()
    return data
