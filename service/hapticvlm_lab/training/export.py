"""From a trained network to the files that ship: folded ONNX, int8 where it holds, safetensors.

Batch norms and layer scales are folded into their neighbours, so the graph is convolutions, matrix
products and GELU. Dynamic int8 quantises the matrix products alone (most of the work) and needs no
calibration pictures.
"""

from __future__ import annotations

import copy
import hashlib
import json
import warnings
from pathlib import Path

import torch
from torch import Tensor, nn

from hapticvlm_lab.training.network import Block, Network, Shape

OPSET = 17
PRECISIONS = ("float32", "int8")


def fold(network: Network) -> Network:
    """Return an equal network without batch norms and layer scales; for inference only."""
    folded = copy.deepcopy(network).eval()
    for block in folded.modules():
        if isinstance(block, Block):
            _into_before(block.depthwise, block.norm)
            block.norm = nn.Identity()  # type: ignore[assignment]
            block.contract.weight.data *= block.scale.data[:, None]
            block.contract.bias.data *= block.scale.data
            block.scale.data.fill_(1.0)
    _fold_stem(folded.stem)
    _fold_steps(folded.stages)
    _into_after(folded.norm, folded.project)
    folded.norm = nn.Identity()  # type: ignore[assignment]
    return folded


def write(network: Network, name: str, side: int, out: Path, precision: str = "int8") -> None:
    """Write encoder.onnx, encoder.safetensors and encoder.json into a folder."""
    from safetensors.torch import save_file

    out.mkdir(parents=True, exist_ok=True)
    weights = {
        key: value.half().contiguous() if value.dtype.is_floating_point else value
        for key, value in network.state_dict().items()
    }
    save_file(weights, out / "encoder.safetensors", {"shape": json.dumps(network.shape.as_dict())})
    _write_onnx(fold(network), side, out / "encoder.onnx", precision)
    files = ("encoder.onnx", "encoder.safetensors")
    facts = {
        "name": name,
        "side": side,
        "dimension": network.shape.dimension,
        "precision": precision,
        "shape": network.shape.as_dict(),
        "parameters": sum(p.numel() for p in network.parameters()),
        "sha256": {file: hashlib.sha256((out / file).read_bytes()).hexdigest() for file in files},
    }
    (out / "encoder.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")


def read(folder: Path) -> Network:
    """Load the network back from its safetensors, as torch module in evaluation mode."""
    from safetensors import safe_open

    with safe_open(folder / "encoder.safetensors", "pt") as file:
        fields = json.loads(file.metadata()["shape"])
        weights = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    shape = Shape(tuple(fields["depths"]), tuple(fields["widths"]), fields["dimension"])
    network = Network(shape)
    network.load_state_dict(
        {key: v.float() if v.dtype.is_floating_point else v for key, v in weights.items()}
    )
    return network.eval()


def _write_onnx(folded: Network, side: int, path: Path, precision: str) -> None:
    whole = path if precision == "float32" else path.with_suffix(".float32.onnx")
    with warnings.catch_warnings():
        # The newer exporter needs one more package and writes the same graph.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            folded,
            (torch.zeros(2, side, side, 4, dtype=torch.uint8),),
            str(whole),
            input_names=["crops"],
            output_names=["embeddings"],
            dynamic_axes={"crops": {0: "n"}, "embeddings": {0: "n"}},
            opset_version=OPSET,
            dynamo=False,
        )
    if precision == "int8":
        from onnxruntime.quantization import QuantType, quantize_dynamic

        quantize_dynamic(
            str(whole),
            str(path),
            op_types_to_quantize=["MatMul"],
            per_channel=True,
            weight_type=QuantType.QInt8,
        )
        whole.unlink()


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


def _into_after(norm: nn.BatchNorm1d | nn.BatchNorm2d, layer: nn.Conv2d | nn.Linear) -> None:
    """Fold a norm into the layer after it; only where that one pads nothing."""
    gain, shift = _affine(norm)
    assert layer.bias is not None
    if isinstance(layer, nn.Conv2d):
        layer.bias.data += torch.einsum("oihw,i->o", layer.weight.data, shift)
        layer.weight.data *= gain.view(1, -1, 1, 1)
    else:
        layer.bias.data += layer.weight.data @ shift
        layer.weight.data *= gain


def _fold_stem(stem: nn.Sequential) -> None:
    for number in range(len(stem) - 1):
        conv, norm = stem[number], stem[number + 1]
        if isinstance(conv, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d):
            _into_before(conv, norm)
            stem[number + 1] = nn.Identity()


def _fold_steps(stages: nn.Sequential) -> None:
    for number in range(len(stages) - 1):
        norm, conv = stages[number], stages[number + 1]
        if isinstance(norm, nn.BatchNorm2d) and isinstance(conv, nn.Conv2d):
            _into_after(norm, conv)
            stages[number] = nn.Identity()
