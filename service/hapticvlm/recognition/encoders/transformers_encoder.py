"""Any image network of transformers as an encoder, by folder or by name, on the cpu or a GPU.

The embedding is the mean of the network's last spatial map, weighted by how much of each cell lies
under the mask, then the network's own final layer norm, then unit norm: with a full mask it is what
a ConvNeXt itself pools. The preprocessing is the one in the network's own file. torch and
transformers (extra `models`) are imported only when such a network is named. Knows no gallery and
not where networks come from.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import isqrt
from typing import TYPE_CHECKING, Any

from hapticvlm.recognition.encoders import networks
from hapticvlm.recognition.encoders.encoder import EncoderError, Floats, Pixels, embed_all
from hapticvlm.recognition.encoders.preprocessing import Preprocessing, read_preprocessing
from hapticvlm.recognition.pictures import Crop

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True)
class TransformersEncoder:
    """A network of transformers behind the Encoder protocol; `network` is on `device`."""

    name: str
    dimension: int
    preprocessing: Preprocessing
    network: Any
    device: str

    @property
    def side(self) -> int:
        """Side of the crops it takes, px."""
        return self.preprocessing.side

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, D) float32, each of unit norm. Raises EncoderError."""
        return embed_all(crops, self, self._run)

    def _run(self, pixels: Pixels) -> Floats:
        import torch

        images, masks = (torch.from_numpy(part) for part in self.preprocessing.apply(pixels))
        with torch.inference_mode():
            embeddings = pool(self.network, images.to(self.device), masks.to(self.device))
        found: Floats = embeddings.cpu().numpy()
        return found


def load_transformers_encoder(name: str, device: str, threads: int) -> TransformersEncoder:
    """Load a network by folder or by name; sets torch's threads. Raises EncoderError.

    A folder never touches the network; a name is looked up in this machine's cache first.
    """
    source = networks.find(name)
    place = _set_up(name, device, threads)
    network, given = networks.read(source)
    try:
        preprocessing = read_preprocessing(given)
    except ValueError as error:
        text = f"encoder `{name}`, preprocessor_config.json: {error}"
        raise EncoderError(f"{text}; correct the file in a copy of the folder") from None
    network = network.to(place)
    dimension = _measure(name, network, preprocessing.input_side)
    label = f"{networks.label(source)} (transformers)"
    return TransformersEncoder(label, dimension, preprocessing, network, place)


def pool(network: Any, images: Tensor, masks: Tensor) -> Tensor:  # noqa: ANN401 - any network
    """Embed images (N, 3, I, I) float32 under masks (N, I, I) 0..1: (N, D) of unit norm.

    An empty mask counts as a full one. A network without a spatial map gives what it pools itself.
    """
    from torch.nn import functional

    outputs = network(pixel_values=images)
    cells = _cells(outputs.last_hidden_state)
    if cells is None:
        return functional.normalize(outputs.pooler_output.flatten(1), dim=1)
    weights = functional.adaptive_avg_pool2d(masks[:, None], (cells.shape[2], cells.shape[3]))
    weights = weights + (weights.sum(dim=(2, 3), keepdim=True) <= 0)
    pooled = (cells * weights).sum(dim=(2, 3)) / weights.sum(dim=(2, 3))
    final = getattr(network, "layernorm", None)
    if final is not None and outputs.last_hidden_state.ndim == 4:  # tokens have been through it
        pooled = final(pooled)
    return functional.normalize(pooled, dim=1)


def _cells(features: Tensor) -> Tensor | None:
    """Make a spatial map (N, D, h, w) of a map, or of tokens whose last ones are a square."""
    if features.ndim == 4:
        return features
    if features.ndim != 3:
        return None
    side = isqrt(features.shape[1])
    return features[:, -side * side :].transpose(1, 2).reshape(len(features), -1, side, side)


def _set_up(name: str, device: str, threads: int) -> str:
    """Import what is needed, quietly, and return the device to run on. Raises EncoderError."""
    if threads > 1:  # waiting threads that spin starve the gateway and each other
        os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.environ.setdefault("DISABLE_SAFETENSORS_CONVERSION", "1")  # asks the hub for one otherwise
    try:
        import torch
        from huggingface_hub.utils import logging as hub_logging
        from transformers.utils import logging as network_logging
    except ImportError as error:
        text = f"encoder `{name}` needs torch and transformers ({error})"
        raise EncoderError(f"{text}: {networks.CURE}") from None
    for log in (network_logging, hub_logging):
        log.set_verbosity_error()
    network_logging.disable_progress_bar()
    torch.set_num_threads(threads)
    has_cuda = torch.cuda.is_available()
    if device == "cuda" and not has_cuda:
        text = "--device cuda: torch finds no CUDA device here"
        raise EncoderError(f"{text}; use --device cpu, or install the torch that fits the GPU")
    return "cuda" if has_cuda and device != "cpu" else "cpu"


def _measure(name: str, network: Any, side: int) -> int:  # noqa: ANN401 - any network
    """Embed nothing once: how long an embedding is. Raises EncoderError for what is no encoder."""
    import torch

    nothing = torch.zeros((1, 3, side, side), device=network.device)
    try:
        with torch.inference_mode():
            return int(pool(network, nothing, nothing[:, 0]).shape[1])
    except Exception as error:  # noqa: BLE001 - each kind of network fails in its own way
        kind = type(network).__name__
        text = f"encoder `{name}` is a {kind}, which embeds no picture ({networks.line(error)})"
        raise EncoderError(f"{text}; give a ConvNeXt") from None
