"""The graph of the shipped encoder: an EfficientNet-Lite, and our own head.

The input is a crop (N, S, S, 4) uint8, RGB and mask. The network is Tan and Le's EfficientNet in
its Lite form (no squeeze, ReLU6, TensorFlow's padding). The map of each stage is averaged under the
mask, which gives mean and standard deviation of each channel; the last map gives its mean, and the
scores of ImageNet's classes.

The head standardises these numbers, and one hidden layer turns them into an embedding. Beside it
the class scores become beliefs in the materials (joint_embedding), all inside of the graph.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from onnx import ModelProto, TensorProto

from hapticvlm.vision.encoders import joint_embedding
from hapticvlm_lab.training.graph_writer import GraphWriter, Ranges

Floats = NDArray[np.float32]

STEM = 32
STRIDES = (1, 2, 2, 2, 1, 2, 1)  # of the seven stages
KERNELS = (3, 3, 5, 3, 5, 5, 3)
EXPANSION = 6
LAST = 1280  # channels of the last map
LARGEST_ACTIVATION = 6.0  # of ReLU6
AROUND = 0.1  # weight of a cell outside of the mask, beside 1 inside
# a channel's value is (level - 127) / 128
MIDDLE_LEVEL = 127
LEVELS = 128
FULL_MASK = 255.0
TINY = 1e-6  # keeps a head that sees nothing from dividing by zero


@dataclass(frozen=True, slots=True)
class Network:
    """Side of its crops (px); widths and numbers of blocks of its stages."""

    side: int
    widths: tuple[int, ...]
    blocks: tuple[int, ...]

    @property
    def features(self) -> int:
        """Number of features that are pooled from it."""
        return 2 * sum(self.widths[1:]) + LAST


LITE0 = Network(224, (16, 24, 40, 80, 112, 192, 320), (1, 2, 2, 3, 3, 4, 1))


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


def describing(network: Network, ranges: Ranges | None) -> tuple[ModelProto, GraphWriter]:
    """Build the graph with outputs "features" (N, F) and "scores" (N, 1000).

    Without ranges it is a graph of floats; its further outputs are the tensors whose ranges are
    taken.
    """
    graph = GraphWriter(ranges)
    features, scores = _describe(graph, network)
    outputs: dict[str, list[int | str | None] | None] = {
        features: ["N", network.features],
        scores: ["N", joint_embedding.CLASSES],
    }
    if ranges is None:
        outputs |= dict.fromkeys(graph.watched)
    return graph.model(network.side, outputs), graph


def embedding(network: Network, ranges: Ranges, head: Head) -> tuple[ModelProto, GraphWriter]:
    """Build the graph that ships, with outputs "embeddings" (N, D) and "classes" (N, 1000)."""
    graph = GraphWriter(ranges)
    features, scores = _describe(graph, network)
    hidden = _hidden(graph, features, head)
    levels = _levels(graph, scores)
    # The embedding has unit norm: a fixed share belongs to the hidden layer, the rest to the
    # levels, and one number fills up whatever the levels leave of theirs.
    squares = graph.add("ReduceSumSquare", [levels], "levels.squares", axes=[1], keepdims=1)
    left = graph.add(
        "Sub", [_number(graph, "share", joint_embedding.SHARE), squares], "levels.left"
    )
    rest = graph.add("Sqrt", [graph.add("Relu", [left], "levels.positive")], "rest")
    factor = _number(graph, "features.share", math.sqrt(1.0 - joint_embedding.SHARE))
    shared = graph.add("Mul", [hidden, factor], "hidden.shared")
    graph.add("Concat", [shared, levels, rest], "embeddings", axis=1)
    outputs: dict[str, list[int | str | None] | None] = {
        "embeddings": ["N", head.dimension],
        "classes": ["N", joint_embedding.CLASSES],
    }
    return graph.model(network.side, outputs), graph


def _describe(graph: GraphWriter, network: Network) -> tuple[str, str]:
    """Add the network; return the names of its features and scores."""
    x, mask = _read(graph)
    x = _convolve(graph, x, "_conv_stem", (STEM, 3, 3, 3), 2)
    mask = _halved(graph, mask, "mask.stem")
    width = STEM
    block = 0
    parts: list[str] = []
    for stage, (out, count) in enumerate(zip(network.widths, network.blocks, strict=True)):
        if STRIDES[stage] == 2:
            mask = _halved(graph, mask, f"mask.{stage}")
        for place in range(count):
            stride = STRIDES[stage] if place == 0 else 1
            x = _block(graph, x, f"_blocks.{block}.", (width, out), (stage, stride))
            width = out
            block = block + 1
        parts += _pooled(graph, x, mask, f"stage.{stage}") if stage else []
    x = _convolve(graph, x, "_conv_head", (LAST, width, 1, 1))
    parts.append(_mean(graph, _rows(graph, x, "last"), mask, "last"))
    whole = graph.add("GlobalAveragePool", [x], "whole")
    flat = graph.rounded(graph.add("Flatten", [whole], "flat"))
    scores = graph.layer("Gemm", flat, "_fc", (joint_embedding.CLASSES, LAST), transB=1)
    return graph.add("Concat", parts, "features", axis=1), scores


def _read(graph: GraphWriter) -> tuple[str, str]:
    """Split crops into the image (N, 3, S, S), and the mask (N, 1, S, S) from 0 to 1."""
    places = [graph.constant(f"place.{at}", np.array([at], np.int64)) for at in (0, 3, 4)]
    pixels = graph.add("Slice", ["crops", places[0], places[1], places[1]], "pixels")
    inside = graph.add("Slice", ["crops", places[1], places[2], places[1]], "inside")
    planes = graph.add("Transpose", [pixels], "planes", perm=[0, 3, 1, 2])
    image = graph.dequantised(planes, "image", 1 / LEVELS, MIDDLE_LEVEL)
    plane = graph.add("Transpose", [inside], "inside.plane", perm=[0, 3, 1, 2])
    floats = graph.add("Cast", [plane], "inside.floats", to=TensorProto.FLOAT)
    return image, graph.add("Div", [floats, _number(graph, "full", FULL_MASK)], "mask")


def _block(
    graph: GraphWriter, x: str, name: str, widths: tuple[int, int], where: tuple[int, int]
) -> str:
    """Add one inverted residual block; where: its stage, and its stride."""
    (width, out), (stage, stride) = widths, where
    kernel = KERNELS[stage]
    inner = width
    y = x
    if stage:
        inner = width * EXPANSION
        y = _convolve(graph, y, f"{name}_expand_conv", (inner, width, 1, 1))
    y = _convolve(graph, y, f"{name}_depthwise_conv", (inner, 1, kernel, kernel), stride)
    shape = (out, inner, 1, 1)
    y = graph.rounded(graph.layer("Conv", y, f"{name}_project_conv", shape, kernel_shape=[1, 1]))
    if stride == 2 or width != out:
        return y
    return graph.rounded(graph.add("Add", [x, y], f"{name}sum"))


def _convolve(
    graph: GraphWriter, x: str, name: str, shape: tuple[int, int, int, int], stride: int = 1
) -> str:
    """Add a convolution with its rectifier, depthwise if it takes one channel."""
    groups = shape[0] if shape[1] == 1 else 1
    layer = graph.layer(
        "Conv", x, name, shape, kernel_shape=shape[2:], strides=[stride] * 2, group=groups,
        auto_pad="SAME_UPPER",
    )  # fmt: skip
    if graph.ranges is not None:
        return graph.rounded(layer, LARGEST_ACTIVATION)
    least = _number(graph, "least", 0.0)
    most = _number(graph, "most", LARGEST_ACTIVATION)
    graph.watched.append(layer)
    return graph.add("Clip", [layer, least, most], f"{name}.rectified")


def _halved(graph: GraphWriter, mask: str, name: str) -> str:
    """Average a mask over the cells of the next map."""
    two = [2, 2]
    return graph.add(
        "AveragePool", [mask], name, kernel_shape=two, strides=two, auto_pad="SAME_UPPER"
    )


def _pooled(graph: GraphWriter, x: str, mask: str, name: str) -> list[str]:
    """Return mean and standard deviation of a map under the mask, (N, C) each."""
    # Variance as the mean of squares less the square of the mean, in one pass over the map.
    # Rounding can make it slightly negative, hence the rectifier before the root.
    rows = _rows(graph, x, name)
    mean = _mean(graph, rows, mask, name)
    squares = graph.add("Mul", [rows, rows], f"{name}.squares")
    second = _mean(graph, squares, mask, f"{name}.squares")
    square = graph.add("Mul", [mean, mean], f"{name}.mean.square")
    variance = graph.add("Sub", [second, square], f"{name}.variance")
    return [
        mean,
        graph.add("Sqrt", [graph.add("Relu", [variance], f"{name}.least")], f"{name}.dev"),
    ]


def _rows(graph: GraphWriter, x: str, name: str) -> str:
    shape = graph.constant("rows", np.array([0, 0, -1], np.int64))
    return graph.add("Reshape", [x, shape], f"{name}.rows")


def _mean(graph: GraphWriter, rows: str, mask: str, name: str) -> str:
    """Return the mean of (N, C, cells) under a mask, (N, C)."""
    weights = f"{mask}.weights"
    if not graph.has(weights):
        raised = graph.add("Add", [mask, _number(graph, "around", AROUND)], f"{mask}.raised")
        axes = graph.constant("places", np.array([2, 3], np.int64))
        total = graph.add("ReduceSum", [raised, axes], f"{mask}.total", keepdims=1)
        share = graph.add("Div", [raised, total], f"{mask}.share")
        column = graph.constant("column", np.array([0, -1, 1], np.int64))
        graph.add("Reshape", [share, column], weights)
    return graph.add(
        "Flatten", [graph.add("MatMul", [rows, weights], f"{name}.sum")], f"{name}.mean"
    )


def _hidden(graph: GraphWriter, features: str, head: Head) -> str:
    """Add the head's hidden layer; return its activation of unit norm, (N, W)."""
    centred = graph.add("Sub", [features, graph.constant("head.mean", head.mean)], "centred")
    scaled = graph.add("Mul", [centred, graph.constant("head.scale", head.scale)], "scaled")
    unit = _unit(graph, scaled, "unit")
    whole = graph.folded("head.whole", head.weights)
    weights = graph.add("Mul", [whole, graph.constant("head.steps", head.steps)], "head.weights")
    bias = graph.constant("head.bias", head.bias)
    layer = graph.add("Gemm", [unit, weights, bias], "head.layer")
    return _unit(graph, graph.add("Relu", [layer], "head.active"), "hidden")


def _unit(graph: GraphWriter, rows: str, name: str) -> str:
    raised = graph.add("Add", [rows, _number(graph, "tiny", TINY)], f"{name}.raised")
    norm = graph.add("ReduceL2", [raised], f"{name}.norm", axes=[1], keepdims=1)
    return graph.add("Div", [raised, norm], name)


def _levels(graph: GraphWriter, scores: str) -> str:
    """Turn class scores into the levels of joint_embedding.join, (N, BELIEFS)."""
    shares = graph.add("Softmax", [scores], "classes", axis=1)
    table = graph.folded("materials", joint_embedding.material_weights().astype(np.float16))
    known = graph.add("MatMul", [shares, table], "known")
    axes = graph.constant("row", np.array([1], np.int64))
    total = graph.add("ReduceSum", [known, axes], "known.total", keepdims=1)
    none = graph.add("Sub", [_number(graph, "one", 1.0), total], "unknown")
    beliefs = graph.add("Concat", [known, none], "beliefs", axis=1)
    least = _number(graph, "least", 0.0)
    most = _number(graph, "belief.most", 1.0 - joint_embedding.FLOOR)
    clipped = graph.add("Clip", [beliefs, least, most], "beliefs.clipped")
    raised = graph.add(
        "Add", [clipped, _number(graph, "floor", joint_embedding.FLOOR)], "beliefs.raised"
    )
    logs = graph.add("Log", [raised], "beliefs.logs")
    above = graph.add(
        "Sub", [logs, _number(graph, "floor.log", math.log(joint_embedding.FLOOR))], "above"
    )
    return graph.add("Mul", [above, _number(graph, "level", joint_embedding.SCALE)], "levels")


def _number(graph: GraphWriter, name: str, value: float) -> str:
    return graph.constant(name, np.float32(value))
