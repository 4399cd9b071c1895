"""Encoders small enough to build in a test: an ONNX graph, and networks of transformers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vision.pictures import Crop, central_mask

Pixels = NDArray[np.uint8]


@dataclass(frozen=True)
class Graph:
    """Mean colour under the mask, projected; what a field says can be made wrong."""

    side: int = 32
    dimension: int = 128
    batch: str | int = "n"
    input_name: str = "crops"
    is_unit: bool = True
    gain: float = 1.0


def write_onnx(folder: Path, graph: Graph | None = None, **card: Any) -> Path:
    """Write encoder.onnx and the encoder.json of a good graph; `card` overrides its fields."""
    folder.mkdir(parents=True, exist_ok=True)
    data = _graph_bytes(graph or Graph())
    (folder / "encoder.onnx").write_bytes(data)
    good = Graph()
    facts = {"name": "tiny-1", "side": good.side, "dimension": good.dimension}
    facts["sha256"] = {"encoder.onnx": hashlib.sha256(data).hexdigest()}
    (folder / "encoder.json").write_text(json.dumps({**facts, **card}))
    return folder


def _graph_bytes(graph: Graph) -> bytes:
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    rng = np.random.default_rng(1)
    projection = rng.normal(size=(3, graph.dimension)).astype(np.float32) * np.float32(graph.gain)
    constants = {
        "projection": projection,
        "colour": np.array([0, 1, 2], np.int64),
        "mask": np.array([3], np.int64),
        "plane": np.array([1, 2], np.int64),
    }
    node = helper.make_node
    nodes = [
        node("Cast", [graph.input_name], ["levels"], to=TensorProto.FLOAT),
        node("Gather", ["levels", "colour"], ["rgb"], axis=3),
        node("Gather", ["levels", "mask"], ["weight"], axis=3),
        node("Mul", ["rgb", "weight"], ["weighted"]),
        node("ReduceSum", ["weighted", "plane"], ["sum"], keepdims=0),
        node("ReduceSum", ["weight", "plane"], ["area"], keepdims=0),
        node("Div", ["sum", "area"], ["mean"]),
        node("MatMul", ["mean", "projection"], ["raw"]),
        node("LpNormalization", ["raw"], ["unit"], axis=1, p=2),
        node("Identity", ["unit" if graph.is_unit else "raw"], ["embeddings"]),
    ]
    shape = [graph.batch, graph.side, graph.side, 4]
    built = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info(graph.input_name, TensorProto.UINT8, shape)],
        [
            helper.make_tensor_value_info(
                "embeddings", TensorProto.FLOAT, [graph.batch, graph.dimension]
            )
        ],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    model = helper.make_model(built, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    data: bytes = model.SerializeToString()
    return data


def picture(seed: int, side: int) -> Pixels:
    """Coloured blocks with grain."""
    rng = np.random.default_rng(seed)
    blocks = np.kron(rng.uniform(20, 230, (4, 4, 3)), np.ones((side // 4, side // 4, 1)))
    grain = rng.normal(0, 12, (side, side, 3))
    return np.clip(blocks[:side, :side] + grain, 0, 255).astype(np.uint8)


def crop(seed: int, side: int) -> Crop:
    """A picture under the central mask."""
    return Crop(picture(seed, side), central_mask(side))


PROCESSOR = {
    "image_processor_type": "ConvNextImageProcessor",
    "do_resize": True,
    "size": {"shortest_edge": 112},
    "crop_pct": 0.875,
    "do_rescale": True,
    "rescale_factor": 1 / 255,
    "do_normalize": True,
    "image_mean": [0.485, 0.456, 0.406],
    "image_std": [0.229, 0.224, 0.225],
}


def write_network(folder: Path, kind: str = "ConvNext", seed: int = 0, **processor: Any) -> Path:
    """Save a tiny network of random weights as transformers does, and its preprocessing file."""
    import torch

    torch.manual_seed(seed)
    _network(kind).save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps({**PROCESSOR, **processor}))
    return folder


def _network(kind: str) -> Any:
    import transformers as t

    stages: dict[str, Any] = {"hidden_sizes": [8, 16, 24, 32], "depths": [1, 1, 1, 1]}
    text: dict[str, Any] = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    tokens = {**text, "intermediate_size": 16, "image_size": 112, "patch_size": 16}
    if kind == "ConvNext":
        return t.ConvNextModel(t.ConvNextConfig(**stages, layer_scale_init_value=1.0))
    if kind == "ConvNextV2":
        return t.ConvNextV2Model(t.ConvNextV2Config(**stages))
    if kind == "DINOv3ConvNext":
        return t.DINOv3ConvNextModel(t.DINOv3ConvNextConfig(**stages, layer_scale_init_value=1.0))
    if kind == "ResNet":
        return t.ResNetModel(t.ResNetConfig(**stages, embedding_size=8, layer_type="basic"))
    if kind == "ViT":
        return t.ViTModel(t.ViTConfig(**tokens))
    if kind == "Bert":
        return t.BertModel(t.BertConfig(**text, vocab_size=32, intermediate_size=16))
    if kind in ("CLIP", "Siglip"):
        return _of_pictures_and_text(kind, tokens)
    return _classifier(kind, stages)


def _classifier(kind: str, stages: dict[str, Any]) -> Any:
    import transformers as t

    if kind == "ConvNextForImageClassification":
        config = t.ConvNextConfig(**stages, layer_scale_init_value=1.0, num_labels=1000)
        return t.ConvNextForImageClassification(config)
    if kind == "MobileNetV2ForImageClassification":
        # At the usual range of random weights all features of so thin a network are 0.
        tiny: dict[str, Any] = {"depth_multiplier": 0.25, "initializer_range": 0.2}
        config = t.MobileNetV2Config(image_size=112, num_labels=1001, **tiny)
        return t.MobileNetV2ForImageClassification(config)
    raise ValueError(kind)


def _of_pictures_and_text(kind: str, vision: dict[str, Any]) -> Any:
    import transformers as t

    words = {key: vision[key] for key in vision if key not in ("image_size", "patch_size")}
    words |= {"vocab_size": 64, "max_position_embeddings": 64, "eos_token_id": 1, "bos_token_id": 2}
    words["pad_token_id"] = 1
    if kind == "CLIP":
        both = {"text_config": words, "vision_config": vision, "projection_dim": 16}
        return t.CLIPModel(t.CLIPConfig(**both))
    return t.SiglipModel(t.SiglipConfig(text_config=words, vision_config=vision))


def write_classifier(
    path: Path, classes: int = 1000, side: int = 32, seed: int = 1, *, gain: float = 1.0
) -> Path:
    """Write FILE.onnx: floats (N, 3, S, S), a convolution, the mean over places, classes.

    `gain` multiplies the convolution: with 0 the network sees nothing.
    """
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    rng = np.random.default_rng(seed)
    constants = {
        "kernel": rng.normal(size=(8, 3, 4, 4)).astype(np.float32) * np.float32(gain),
        "dense": rng.normal(size=(8, classes)).astype(np.float32),
    }
    node = helper.make_node
    nodes = [
        node("Conv", ["pixels", "kernel"], ["map"], strides=[4, 4]),
        node("GlobalAveragePool", ["map"], ["mean"]),
        node("Flatten", ["mean"], ["flat"]),
        node("MatMul", ["flat", "dense"], ["scores"]),
        node("Softmax", ["scores"], ["shares"]),
    ]
    floats = TensorProto.FLOAT
    built = helper.make_graph(
        nodes,
        "classifier",
        [helper.make_tensor_value_info("pixels", floats, ["n", 3, side, side])],
        [helper.make_tensor_value_info("shares", floats, ["n", classes])],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    model = helper.make_model(built, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())
    return path


def write_graph(
    path: Path, shape: Sequence[Any], nodes: Sequence[Any], outputs: list[str], kind: int = 1
) -> Path:
    """Write FILE.onnx with an input "pixels" of this shape and type, and these nodes."""
    from onnx import helper, numpy_helper

    kernel = np.random.default_rng(3).normal(size=(8, 3, 4, 4)).astype(np.float32)
    graph = helper.make_graph(
        nodes,
        "network",
        [helper.make_tensor_value_info("pixels", kind, shape)],
        [helper.make_tensor_value_info(name, kind, None) for name in outputs],
        [numpy_helper.from_array(kernel.astype(helper.tensor_dtype_to_np_dtype(kind)), "kernel")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    path.write_bytes(model.SerializeToString())
    return path
