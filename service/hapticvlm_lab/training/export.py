"""From a trained network to the files that ship: folded ONNX, and safetensors for training on.

Batch norms are folded into the convolutions before them, so that the graph is convolutions, ReLU
and one matrix product. Weights are stored as 8-bit integers with one scale for each output channel
(they are float32 again when loaded): a quarter of the bytes, the same speed.
"""

from __future__ import annotations

import copy
import hashlib
import json
import warnings
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hapticvlm_lab.training.network import Block, Network, Shape

OPSET = 17
INT8_MOST = 127
GRAPH, WEIGHTS, CARD = "encoder.onnx", "encoder.safetensors", "encoder.json"


def fold(network: Network) -> Network:
    """Return an equal network without batch norms; for inference only."""
    folded = copy.deepcopy(network).eval()
    for block in folded.modules():
        if isinstance(block, Block):
            _into_before(block.first, block.first_norm)
            _into_before(block.second, block.second_norm)
            block.first_norm = nn.Identity()  # type: ignore[assignment]
            block.second_norm = nn.Identity()  # type: ignore[assignment]
            _fold_sequence(block.shortcut)
    _fold_sequence(folded.stem)
    _into_after(folded.norm, folded.project)
    folded.norm = nn.Identity()  # type: ignore[assignment]
    return folded


def write(network: Network, name: str, side: int, out: Path, weights: Path | None = None) -> None:
    """Write encoder.onnx and encoder.json into `out`, encoder.safetensors into `weights` or it."""
    from safetensors.torch import save_file

    place = weights or out
    for folder in (out, place):
        folder.mkdir(parents=True, exist_ok=True)
    held = {
        key: value.half().contiguous() if value.dtype.is_floating_point else value
        for key, value in network.state_dict().items()
    }
    save_file(held, place / WEIGHTS, {"shape": json.dumps(network.shape.as_dict())})
    _write_graph(fold(network), side, out / GRAPH)
    files = {GRAPH: out / GRAPH, WEIGHTS: place / WEIGHTS}
    facts = {
        "name": name,
        "side": side,
        "dimension": network.shape.dimension,
        "precision": "float32, stored as int8",
        "shape": network.shape.as_dict(),
        "parameters": sum(p.numel() for p in network.parameters()),
        "sha256": {
            file: hashlib.sha256(path.read_bytes()).hexdigest() for file, path in files.items()
        },
    }
    (out / CARD).write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")


def read(folder: Path) -> Network:
    """Load the network back from its safetensors, as torch module in evaluation mode."""
    from safetensors import safe_open

    with safe_open(folder / WEIGHTS, "pt") as file:
        fields = json.loads(file.metadata()["shape"])
        weights = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    network = Network(Shape(tuple(fields["depths"]), tuple(fields["widths"]), fields["dimension"]))
    network.load_state_dict(
        {key: v.float() if v.dtype.is_floating_point else v for key, v in weights.items()}
    )
    return network.eval()


def _write_graph(folded: Network, side: int, path: Path) -> None:
    with warnings.catch_warnings():
        # The newer exporter needs one more package and writes the same graph.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            folded,
            (torch.zeros(2, side, side, 4, dtype=torch.uint8),),
            str(path),
            input_names=["crops"],
            output_names=["embeddings"],
            dynamic_axes={"crops": {0: "n"}, "embeddings": {0: "n"}},
            opset_version=OPSET,
            dynamo=False,
        )
    _store_small(path)


def _store_small(path: Path) -> None:
    """Store large weights as int8 times a scale of each first index: onnxruntime folds it away."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    model = onnx.load(str(path))
    nodes, scales = [], []
    for weight in model.graph.initializer:
        values = numpy_helper.to_array(weight)
        if weight.data_type == TensorProto.FLOAT and values.size > 1024:
            name = weight.name
            steps, scale = round_to_int8(values)
            weight.CopyFrom(numpy_helper.from_array(steps, f"{name}.steps"))
            scales.append(numpy_helper.from_array(scale, f"{name}.scale"))
            cast = helper.make_node("Cast", [f"{name}.steps"], [f"{name}.f"], to=TensorProto.FLOAT)
            nodes += [cast, helper.make_node("Mul", [f"{name}.f", f"{name}.scale"], [name])]
    model.graph.initializer.extend(scales)
    for node in reversed(nodes):
        model.graph.node.insert(0, node)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def round_to_int8(weight: NDArray[np.float32]) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Return steps of a weight's shape (O, ...) and the float32 size of a step for each O."""
    most = np.abs(weight).reshape(len(weight), -1).max(axis=1)
    scale = np.maximum(most / INT8_MOST, np.finfo(np.float32).tiny).astype(np.float32)
    scale = scale.reshape(-1, *[1] * (weight.ndim - 1))
    return np.rint(weight / scale).astype(np.int8), scale


def _affine(norm: nn.BatchNorm1d | nn.BatchNorm2d) -> tuple[Tensor, Tensor]:
    assert norm.running_var is not None
    assert norm.running_mean is not None
    gain = norm.weight.data / torch.sqrt(norm.running_var + norm.eps)
    return gain, norm.bias.data - norm.running_mean * gain


def _into_before(conv: nn.Conv2d, norm: nn.BatchNorm2d) -> None:
    """Fold a norm into the convolution before it."""
    gain, shift = _affine(norm)
    conv.weight.data *= gain.view(-1, 1, 1, 1)
    conv.bias = nn.Parameter(shift.clone())


def _into_after(norm: nn.BatchNorm1d, layer: nn.Linear) -> None:
    """Fold a norm into the layer after it."""
    gain, shift = _affine(norm)
    layer.bias.data += layer.weight.data @ shift
    layer.weight.data *= gain


def _fold_sequence(layers: nn.Sequential) -> None:
    for number in range(len(layers) - 1):
        conv, norm = layers[number], layers[number + 1]
        if isinstance(conv, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d):
            _into_before(conv, norm)
            layers[number + 1] = nn.Identity()
