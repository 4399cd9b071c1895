"""An image network in one file, ONNX or TFLite, as an encoder; OpenVINO reads it (extra `files`).

The features are the input of the network's last mean over places, averaged under the mask; where
there is no such mean, what its last layer is given, of the whole crop. The class scores of an
ImageNet classifier are read as materials. Colours are prepared as a preprocessor_config.json beside
the file has; without one, bytes are given as they are, and floats as most exports want them, which
is logged. Knows no gallery.
"""

from __future__ import annotations

import hashlib
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.errors import installing
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import EncoderError, Floats, Pixels, embed_all
from hapticvlm.vision.encoders.networks import (
    FINGERPRINT,
    PREPROCESSING,
    Colour,
    Preprocessing,
    read_preprocessing,
    short_line,
)
from hapticvlm.vision.pictures import Crop

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_DEVIATION = (0.229, 0.224, 0.225)
HALF = (0.5, 0.5, 0.5)
# EfficientNet-Lite keeps TensorFlow's (level - 127) / 128 in torch's order of colours, too.
LITE = "efficientnet[-_]?lite"
LITE_MEAN = (127 / 255,) * 3
LITE_DEVIATION = (128 / 255,) * 3
SETTINGS = {
    "INFERENCE_PRECISION_HINT": "f32",  # half precision elsewhere would be another network
    "ENABLE_CPU_PINNING": False,  # else every process that recognises crowds onto the first core
}
_POOLING = ("ReduceMean", "AvgPool")
_DENSE = ("MatMul", "Convolution")
_SIDES_PX = range(16, 1025)

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Layout:
    """What the network's input wants: its side in px, bytes or floats, colours last or first."""

    side: int
    is_bytes: bool
    colours_last: bool


@dataclass(frozen=True, slots=True)
class FileEncoder:
    """A compiled network behind the Encoder protocol; its outputs are features and scores."""

    name: str
    revision: str
    dimension: int
    beliefs: bool
    layout: Layout
    preprocessing: Preprocessing | None
    network: Any

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
        found = self.network(images)
        features = _pool(np.asarray(found[0], np.float32), masks)
        if not self.beliefs:
            return joint_embedding.join(features, None)
        scores = np.asarray(found[1], np.float32).reshape(len(features), -1)
        return joint_embedding.join(features, joint_embedding.material_beliefs(scores))


def load_file_encoder(path: Path, threads: int = 1) -> FileEncoder:
    """Load FILE.onnx or FILE.tflite. Raises EncoderError."""
    if not path.is_file():
        raise EncoderError(f"encoder `{path}`: no such file")
    try:
        import openvino
    except ImportError as error:
        text = f"encoder `{path}` needs OpenVINO, which reads ONNX and TFLite files ({error})"
        raise EncoderError(f"{text}: {installing('openvino')}") from None
    core = openvino.Core()
    try:
        _refuse_markup(path)
        whole = core.read_model(path)
        layout = _layout(whole)
        whole.reshape({whole.input(0): _shape(layout)})
        features = _find_features(whole)
        scores = _find_scores(whole)
        outputs = [features] if scores is None else [features, scores]
        cut = openvino.Model(outputs, whole.get_parameters(), path.stem)
        network = core.compile_model(cut, "CPU", {"INFERENCE_NUM_THREADS": threads, **SETTINGS})
    except Exception as error:  # noqa: BLE001 - whatever a foreign file trips
        text = f"encoder `{path}` cannot be read ({short_line(error)})"
        raise EncoderError(f"{text}; give an image network as FILE.onnx or FILE.tflite") from None
    beliefs = scores is not None
    digest = _fingerprint(path)
    preprocessing = _read_preprocessing(path, layout)
    width = _width(features.get_partial_shape())
    name = f"{path.stem}-{digest} ({'classes' if beliefs else 'features'})"
    dimension = width + joint_embedding.ADDED * beliefs
    revision = f"{digest} {preprocessing}"  # prepared otherwise, it is another network
    return FileEncoder(name, revision, dimension, beliefs, layout, preprocessing, network)


def _refuse_markup(path: Path) -> None:
    """Refuse OpenVINO's XML, which it reads whatever a file's ending is. Raises ValueError."""
    with documents.open_file(path) as file:
        begin = file.read(1024).replace(b"\0", b"")  # UTF-16 has one beside each mark
    if begin.lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n").startswith(b"<"):
        raise ValueError("it holds XML")


def _fingerprint(path: Path) -> str:
    with documents.open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:FINGERPRINT]


def _layout(network: Any) -> Layout:  # noqa: ANN401 - OpenVINO is untyped
    """Read the layout of the one input. Raises ValueError."""
    if len(network.inputs) != 1:
        raise ValueError(f"it has {len(network.inputs)} inputs, an image network has one")
    given = network.input(0)
    sizes = [part.get_length() if part.is_static else 0 for part in given.get_partial_shape()]
    if len(sizes) != 4 or 3 not in (sizes[1], sizes[3]):
        raise ValueError(f"its input is {sizes}, not (N, S, S, 3) or (N, 3, S, S)")
    colours_last = sizes[3] == 3
    height, width = sizes[1:3] if colours_last else sizes[2:]
    side = height or width or 224  # what nearly all take whose file leaves it open
    if (width or side) != side or side not in _SIDES_PX:
        raise ValueError(f"it takes {height} x {width} px, not a square of 16 to 1024 px")
    kind = given.get_element_type().get_type_name()
    if kind not in ("u8", "f32", "f16"):
        raise ValueError(f"its input is of type {kind}; u8 and f32 are read")
    return Layout(side, kind == "u8", colours_last)


def _shape(layout: Layout) -> list[int]:
    side = layout.side
    return [1, side, side, 3] if layout.colours_last else [1, 3, side, side]


def _find_features(network: Any) -> Any:  # noqa: ANN401
    """Find the map (1, D, h, w or 1, h, w, D) before the last mean, else the last layer's input."""
    nodes = network.get_ordered_ops()
    for node in reversed(nodes):
        # A file says nothing of what its layers mean. But nearly every image network ends by a mean
        # over places, and what goes into it is the map that can be averaged under a mask instead.
        # The last such mean counts: squeeze-and-excitation blocks have means of their own before
        # it.
        if node.get_type_name() in _POOLING and _is_over_places(node):
            return node.input_value(0)
    for node in reversed(nodes):
        if node.get_type_name() in _DENSE and node.input_value(0).get_partial_shape().rank == 2:
            return node.input_value(0)
    return network.output(0).get_node().input_value(0)


def _is_over_places(node: Any) -> bool:  # noqa: ANN401
    """Whether a node averages a map of several places to one."""
    before = node.input_value(0).get_partial_shape()
    after = node.output(0).get_partial_shape()
    if before.is_dynamic or len(before) != 4 or after.is_dynamic:
        return False
    sizes = [part.get_length() for part in after]
    return int(np.prod(sizes)) == _width(before) < int(np.prod(before.to_shape()))


def _width(shape: Any) -> int:  # noqa: ANN401
    """How many features there are: of a map, the larger of first and last (7 x 7 x 1280)."""
    sizes = list(shape.to_shape())
    if len(sizes) != 4:
        return int(np.prod(sizes))
    return int(sizes[1] if sizes[2] == sizes[3] else sizes[3])


def _find_scores(network: Any) -> Any:  # noqa: ANN401
    """Find the class scores of an ImageNet classifier before its softmax; None for another."""
    result = network.output(0).get_node().input_value(0)
    softmax = [n for n in network.get_ordered_ops() if n.get_type_name() in ("Softmax", "SoftMax")]
    if softmax and softmax[-1].output(0).get_partial_shape() == result.get_partial_shape():
        result = softmax[-1].input_value(0)
    shape = result.get_partial_shape()
    if shape.is_dynamic or not joint_embedding.is_imagenet(int(np.prod(shape.to_shape()))):
        return None
    return result


def _read_preprocessing(path: Path, layout: Layout) -> Preprocessing | None:
    """Read the file beside the network, else assume; None for bytes, given as they are."""
    beside = next((path.parent / n for n in PREPROCESSING if (path.parent / n).is_file()), None)
    if layout.is_bytes:
        return None
    side = layout.side
    if beside is None:
        mean, deviation = _usual(path, layout)
        text = "encoder `%s`: no %s beside it, so colours are taken to have mean %s, deviation %s"
        logger.warning(text, path.name, PREPROCESSING[0], mean, deviation)
        return Preprocessing(side, side, 1 / 255, mean, deviation)
    try:
        found = read_preprocessing(documents.parse_json(documents.read_bytes(beside)))
    except (OSError, ValueError) as error:
        raise EncoderError(f"encoder `{path}`, {beside.name}: {error}; correct it") from None
    if found.input_side != side:
        text = f"encoder `{path}` takes {side} px, {beside.name} says {found.input_side}"
        raise EncoderError(f"{text}; correct it")
    return found


def _usual(path: Path, layout: Layout) -> tuple[Colour, Colour]:
    """Return the mean and deviation that a family's exports take, known by name and shape."""
    if re.search(LITE, path.stem, re.IGNORECASE):
        return LITE_MEAN, LITE_DEVIATION
    return (HALF, HALF) if layout.colours_last else (IMAGENET_MEAN, IMAGENET_DEVIATION)


def _prepare(
    pixels: Pixels, layout: Layout, preprocessing: Preprocessing | None
) -> tuple[NDArray[np.generic], Floats]:
    """Make the network's input of (1, S, S, 4) uint8, and its mask (1, I, I) 0..1."""
    if preprocessing is None:
        images = pixels[..., :3]
        masks = (pixels[..., 3] > 0).astype(np.float32)
        order = images if layout.colours_last else images.transpose(0, 3, 1, 2)
        return np.ascontiguousarray(order), masks
    floats, masks = preprocessing.apply(pixels)
    given = floats.transpose(0, 2, 3, 1) if layout.colours_last else floats
    return np.ascontiguousarray(given), masks


def _pool(features: Floats, masks: Floats) -> Floats:
    """Average a map under the masks: (N, D). What is no map is given back flat."""
    from PIL import Image

    if features.ndim != 4:
        return features.reshape(len(features), -1)
    if features.shape[2] != features.shape[3]:
        features = features.transpose(0, 3, 1, 2)
    size = (features.shape[3], features.shape[2])
    cells = [np.asarray(Image.fromarray(m).resize(size, Image.Resampling.BOX)) for m in masks]
    weights = np.stack([cell if cell.any() else np.ones_like(cell) for cell in cells])
    weights = weights / weights.sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.einsum("nchw,nhw->nc", features, weights), np.float32)
