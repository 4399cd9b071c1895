"""Uses an image network in one ONNX file as an encoder, run by onnxruntime. Knows no gallery.

The features are the input of the network's last mean over places, averaged under the mask; without
such a mean its output of tokens, without the class token; else the input of its last dense layer,
of the whole crop. The class scores of an ImageNet classifier are read as materials. Axes that a
file leaves open are tried. Colours are prepared as a preprocessor_config.json beside it or one
folder up states; without one, bytes are passed on as they are, and of floats the USUAL preparations
are left to be tried (galleries/storage.py).
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import printable, short_line
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import (
    FINGERPRINT,
    EncoderError,
    Floats,
    Pixels,
    embed_all,
)
from hapticvlm.vision.encoders.onnx_encoder import MAX_BYTES, READ_S, open_session
from hapticvlm.vision.encoders.onnx_graph import Graph, read_graph, with_outputs
from hapticvlm.vision.encoders.preprocessing import (
    PREPROCESSING,
    Colour,
    Preprocessing,
    read_preprocessing,
)
from hapticvlm.vision.pictures import Crop

# Scale, mean and deviation of levels 0..255, by what they give.
USUAL: Mapping[str, tuple[float, Colour, Colour]] = {
    "ImageNet's mean and deviation": (1 / 255, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)),
    "-1 to 1": (1 / 255, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)),
    "0 to 255": (1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
}
TYPES: Mapping[str, type[np.generic]] = {
    "tensor(uint8)": np.uint8,
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(double)": np.float64,
}
_POOLING = ("GlobalAveragePool", "AveragePool", "ReduceMean")
_DENSE = ("MatMul", "Gemm")
_SOFTMAX = "Softmax"
_SIDES_PX = range(16, 1025)
USUAL_SIDE = 224  # px, what nearly all take whose file leaves it open
LONG = 400  # characters of onnxruntime's reason, which stands behind a place in its source
_PLACE_IN_SOURCE = re.compile(
    r"\[ONNXRuntimeError\] : \d+ : \w+ : |\S+\.(?:cc|h):\d+ \S+\((?:[^()]|\([^()]*\))*\)\s"
)


@dataclass(frozen=True, slots=True)
class Layout:
    """The input that a network takes: its name, side in px, type, and colours last or first."""

    name: str
    side: int
    dtype: type[np.generic]
    colours_last: bool

    @property
    def is_bytes(self) -> bool:
        """Whether it takes levels 0..255, so that nothing is left to prepare."""
        return self.dtype is np.uint8


@dataclass(frozen=True, slots=True)
class FileEncoder:
    """A network behind the Encoder protocol; `outputs` names its features and, if any, scores.

    preparations: those of USUAL that may be meant, () where one is stated; the first is taken.
    """

    name: str
    digest: str
    dimension: int
    beliefs: bool
    layout: Layout
    preprocessing: Preprocessing | None
    session: Any
    outputs: tuple[str, ...]
    preparations: tuple[Preprocessing, ...] = ()

    @property
    def revision(self) -> str:
        """The weights and the preparation: prepared otherwise, it is another network."""
        return f"{self.digest} {self.preprocessing}"

    def prepared(self, preparation: Preprocessing) -> FileEncoder:
        """Return the same network with pictures prepared in this way."""
        return replace(self, preprocessing=preparation, preparations=())

    @property
    def side(self) -> int:
        """Side of the crops it takes, px."""
        return self.preprocessing.side if self.preprocessing else self.layout.side

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, D) float32, each of unit norm. Raises EncoderError."""
        return embed_all(crops, self, self._run)

    def _run(self, pixels: Pixels) -> Floats:
        return np.concatenate([self._embed(pixels[row : row + 1]) for row in range(len(pixels))])

    def _embed(self, pixels: Pixels) -> Floats:
        images, masks = _prepare(pixels, self.layout, self.preprocessing)
        try:
            outputs = self.session.run(self.outputs, {self.layout.name: images})
        except Exception as error:  # noqa: BLE001 - onnxruntime's errors share no base of their own
            raise EncoderError(f"encoder `{self.name}` failed ({short_line(error)})") from None
        features = pool(np.asarray(outputs[0], np.float32), masks)
        if not self.beliefs:
            return joint_embedding.join(features, None)
        scores = np.asarray(outputs[1], np.float32).reshape(len(features), -1)
        return joint_embedding.join(features, joint_embedding.material_beliefs(scores))


def load_file_encoder(path: Path, threads: int = 1) -> FileEncoder:
    """Load FILE.onnx; the weights may lie in further files of its folder. Raises EncoderError."""
    if not path.is_file():
        raise EncoderError(f"encoder `{path}`: no such file")
    try:
        model = _read(path)
        graph = read_graph(model)
        _require_weights(path, graph)
        # What a tensor inside a graph is like is seldom written in the file. So the network runs
        # once, on a grey picture, with all tensors in question as outputs, and their sizes are
        # read. Then it is opened again with those outputs alone that are needed, since onnxruntime
        # cannot fuse nodes across a tensor that it has to give out.
        inner = _in_question(graph)
        probe = open_session(with_outputs(model, inner), threads, path.parent)
        stated = _stated(path)
        layout, sizes = _run_once(probe, stated, (*inner, *graph.outputs))
        features = _find_features(graph, sizes)
        scores = _find_scores(graph, sizes)
        outputs = (features,) if scores is None else (features, scores)
        added = [name for name in dict.fromkeys(outputs) if name not in graph.outputs]
        session = open_session(with_outputs(model, added), threads, path.parent)
    except EncoderError:
        raise
    except Exception as error:  # noqa: BLE001 - whatever a foreign file trips
        reason = printable(_PLACE_IN_SOURCE.sub("", str(error)), LONG)
        problem = f"encoder `{path}` cannot be read ({reason})"
        raise EncoderError(f"{problem}; give an image network as FILE.onnx") from None
    beliefs = scores is not None
    digest = hashlib.sha256(model).hexdigest()[:FINGERPRINT]
    preparations = _preparations(path, layout, stated)
    name = f"{path.stem}-{digest} ({'classes' if beliefs else 'features'})"
    dimension = _width(sizes[features]) + joint_embedding.ADDED * beliefs
    first = next(iter(preparations), None)
    encoder = FileEncoder(name, digest, dimension, beliefs, layout, first, session, outputs)
    return encoder if stated else replace(encoder, preparations=preparations)


def _require_weights(path: Path, graph: Graph) -> None:
    """Refuse a network whose weights were left behind. Raises EncoderError."""
    missing = [name for name in graph.weight_files if not (path.parent / name).is_file()]
    if missing:
        problem = f"encoder `{path}` has its weights in {', '.join(missing)}, which is missing"
        raise EncoderError(f"{problem}; copy it into the same folder")


def _read(path: Path) -> bytes:
    return documents.read_bytes(path, MAX_BYTES, READ_S)


def _layouts(session: Any, stated: Preprocessing | None) -> list[Layout]:  # noqa: ANN401
    """List the layouts that the one input may have, colours first and then last. May be [].

    Most exports leave axes open, even that of the colours. Raises ValueError.
    """
    inputs = session.get_inputs()
    if len(inputs) != 1:
        raise ValueError(f"it has {len(inputs)} inputs; an image network has one")
    port = inputs[0]
    sizes = [size if isinstance(size, int) and size > 0 else 0 for size in port.shape]  # 0: open
    if len(sizes) != 4 or not {sizes[1], sizes[3]} & {0, 3}:
        raise ValueError(f"its input is {sizes}, not (N, S, S, 3) or (N, 3, S, S)")
    if sizes[0] > 1:
        raise ValueError(f"it takes {sizes[0]} pictures at once; export it for 1 or any number")
    dtype = TYPES.get(port.type)
    if dtype is None:
        raise ValueError(f"its input is a {port.type}; it must be one of {', '.join(TYPES)}")
    layouts = []
    for first, colours in ((2, 1), (1, 3)):
        height, width = sizes[first : first + 2]
        side = height or width or (stated.input_side if stated else USUAL_SIDE)
        if sizes[colours] in (0, 3) and (width or side) == side and side in _SIDES_PX:
            layouts.append(Layout(port.name, side, dtype, colours == 3))
    if not layouts:
        raise ValueError(f"its input is {sizes}, not a square of 16 to 1024 px")
    return layouts


def _run_once(
    session: Any,  # noqa: ANN401
    stated: Preprocessing | None,
    names: Sequence[str],
) -> tuple[Layout, dict[str, tuple[int, ...]]]:
    """Return the first layout in which the network runs, and the sizes of its tensors."""
    *others, last = _layouts(session, stated)
    for layout in others:
        with suppress(Exception):  # onnxruntime's errors share no base of their own
            return layout, _sizes(session, layout, names)
    return last, _sizes(session, last, names)


def _in_question(graph: Graph) -> tuple[str, ...]:
    """Name the tensors, other than outputs, that may be the features or the class scores."""
    kinds = (*_POOLING, *_DENSE, _SOFTMAX)
    nodes = [node for node in graph.nodes if node.kind in kinds and node.inputs and node.outputs]
    names = dict.fromkeys(name for node in nodes for name in (node.inputs[0], node.outputs[0]))
    computed = {name for node in graph.nodes for name in node.outputs}
    return tuple(name for name in names if name in computed and name not in graph.outputs)


def _sizes(
    session: Any,  # noqa: ANN401
    layout: Layout,
    names: Iterable[str],
) -> dict[str, tuple[int, ...]]:
    """Run the network on a grey picture; return the sizes of those tensors that hold floats."""
    requested = list(names)
    side = layout.side
    shape = (1, side, side, 3) if layout.colours_last else (1, 3, side, side)
    grey = np.full(shape, 127 if layout.is_bytes else 0, layout.dtype)
    outputs = session.run(requested, {layout.name: grey})
    floats = {name: np.asarray(value) for name, value in zip(requested, outputs, strict=True)}
    return {
        name: value.shape
        for name, value in floats.items()
        if np.issubdtype(value.dtype, np.floating)  # whole numbers have a scale of their own
    }


def _find_features(graph: Graph, sizes: Mapping[str, tuple[int, ...]]) -> str:
    """Find the map (1, D, h, w or 1, h, w, D) before the last mean, else the last layer's input."""
    nodes = [node for node in graph.nodes if node.inputs and node.inputs[0] in sizes]
    for node in reversed(nodes):
        # A file does not state what its layers mean. But nearly every image network ends with a
        # mean over places, and the input of that mean is the map that can be averaged under a mask
        # instead. The last such mean counts, because squeeze-and-excitation blocks have means of
        # their own before it.
        before = sizes[node.inputs[0]]
        after = sizes.get(node.outputs[0])
        if node.kind in _POOLING and after is not None and _is_over_places(before, after):
            return node.inputs[0]
    for name in graph.outputs:
        if len(sizes.get(name, ())) == 3:
            return name
    for node in reversed(nodes):
        if node.kind in _DENSE and len(sizes[node.inputs[0]]) == 2:
            return node.inputs[0]
    if graph.outputs[0] not in sizes:
        raise ValueError("its output is not of floats")
    return graph.outputs[0]


def _is_over_places(before: tuple[int, ...], after: tuple[int, ...]) -> bool:
    """Whether a node averages a map, or tokens, of several places to one."""
    return len(before) in (3, 4) and int(np.prod(after)) == _width(before) < int(np.prod(before))


def _width(sizes: tuple[int, ...]) -> int:
    """Return how many features there are; a map (1, 7, 7, 1280) has them last, not first."""
    if len(sizes) == 3:
        return sizes[2]
    if len(sizes) != 4:
        return int(np.prod(sizes))
    return sizes[1] if sizes[2] == sizes[3] else sizes[3]


def _find_scores(graph: Graph, sizes: Mapping[str, tuple[int, ...]]) -> str | None:
    """Find the class scores of an ImageNet classifier before its softmax; None for another."""
    result = graph.outputs[0]
    last = [node for node in graph.nodes if node.kind == _SOFTMAX and node.inputs[0] in sizes][-1:]
    for node in last:
        if sizes.get(node.outputs[0]) == sizes.get(result):
            result = node.inputs[0]
    is_known = result in sizes and joint_embedding.is_imagenet(int(np.prod(sizes[result])))
    return result if is_known else None


def _stated(path: Path) -> Preprocessing | None:
    """Read the preprocessing beside a network, or one folder up as the hub has it for onnx/."""
    folders = (path.parent, path.resolve().parents[1])
    candidates = (folder / name for folder in folders for name in PREPROCESSING)
    beside = next((file for file in candidates if file.is_file()), None)
    if beside is None:
        return None
    try:
        return read_preprocessing(documents.read_json(beside, dict[str, Any]))
    except (OSError, ValueError) as error:
        reason = documents.reason(error)
        raise EncoderError(f"encoder `{path}`, {beside.name}: {reason}; correct it") from None


def _preparations(
    path: Path, layout: Layout, stated: Preprocessing | None
) -> tuple[Preprocessing, ...]:
    """Return the one that is stated, else the usual ones; () for bytes, which need nothing."""
    side = layout.side
    if layout.is_bytes:
        return ()
    if stated is None:
        return tuple(Preprocessing(side, side, *usual) for usual in USUAL.values())
    if stated.input_side != side:
        problem = f"encoder `{path}` takes {side} px, {PREPROCESSING[0]} says {stated.input_side}"
        raise EncoderError(f"{problem}; correct it")
    return (stated,)


def _prepare(
    pixels: Pixels, layout: Layout, preprocessing: Preprocessing | None
) -> tuple[NDArray[np.generic], Floats]:
    """Turn (1, S, S, 4) uint8 into the network's input and its mask (1, I, I) 0..1."""
    if preprocessing is None:
        images = pixels[..., :3]
        masks = (pixels[..., 3] > 0).astype(np.float32)
        levels = images if layout.colours_last else images.transpose(0, 3, 1, 2)
        return np.ascontiguousarray(levels), masks
    floats, masks = preprocessing.apply(pixels)
    ordered = floats.transpose(0, 2, 3, 1) if layout.colours_last else floats
    return np.ascontiguousarray(ordered, layout.dtype), masks


def pool(features: Floats, masks: Floats) -> Floats:
    """Average a map (N, D, h, w) or (N, h, w, D) under the masks: (N, D); flatten the rest.

    Of tokens (N, T, D) the last ones that form a square are a map; those before it are of the whole
    picture.
    """
    from PIL import Image

    if features.ndim == 3:
        side = isqrt(features.shape[1])
        cells = features[:, -side * side :].transpose(0, 2, 1)
        features = cells.reshape(len(features), -1, side, side)
    if features.ndim != 4:
        return features.reshape(len(features), -1)
    if features.shape[2] != features.shape[3]:
        features = features.transpose(0, 3, 1, 2)
    size = (features.shape[3], features.shape[2])
    parts = [np.asarray(Image.fromarray(m).resize(size, Image.Resampling.BOX)) for m in masks]
    weights = np.stack([part if part.any() else np.ones_like(part) for part in parts])
    weights = weights / weights.sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.einsum("nchw,nhw->nc", features, weights), np.float32)
