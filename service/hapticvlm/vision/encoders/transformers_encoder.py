"""Uses any image network of transformers as an encoder, by folder or name, on the cpu or a GPU.

The embedding is the mean of the network's last spatial map, weighted by the share of each cell that
lies under the mask, then the network's own final layer norm, then unit norm. With a full mask it is
the vector that a ConvNeXt itself pools. The embedding of an ImageNet classifier also holds the
beliefs in materials that its class scores imply. Preprocessing is read from the network's own file.
torch and transformers (extra `models`) are imported only when such a network is named. Knows no
gallery; `networks` finds and reads the files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hapticvlm import documents
from hapticvlm.errors import short_line
from hapticvlm.vision.encoders import joint_embedding, networks
from hapticvlm.vision.encoders.encoder import (
    BATCH,
    GPU_BATCH,
    EncoderError,
    Floats,
    Pixels,
    embed_all,
)
from hapticvlm.vision.encoders.file_encoder import pool
from hapticvlm.vision.encoders.networks import Network
from hapticvlm.vision.encoders.preprocessing import Preprocessing, read_preprocessing
from hapticvlm.vision.pictures import Crop

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True)
class TransformersEncoder:
    """A network of transformers behind the Encoder protocol; `network` is on `device`."""

    name: str
    revision: str
    dimension: int
    preprocessing: Preprocessing
    network: Network
    device: str

    @property
    def side(self) -> int:
        """Side of the crops it takes, px."""
        return self.preprocessing.side

    @property
    def beliefs(self) -> bool:
        """Whether its embeddings hold beliefs in the materials."""
        return self.network.is_classifier

    def embed(self, crops: Sequence[Crop]) -> Floats:
        """Embed N crops: (N, D) float32, each of unit norm. Raises EncoderError."""
        return embed_all(crops, self, self._run, BATCH if self.device == "cpu" else GPU_BATCH)

    def _run(self, pixels: Pixels) -> Floats:
        import torch

        images, masks = (torch.from_numpy(part) for part in self.preprocessing.apply(pixels))
        with torch.inference_mode(), torch.autocast("cuda", enabled=self.device == "cuda"):
            return describe(self.network, images.to(self.device), masks.to(self.device))


def load_transformers_encoder(name: str, device: str, threads: int) -> TransformersEncoder:
    """Load a network by folder or by name; sets torch's threads. Raises EncoderError.

    A folder is read without any connection; a name is looked up in this machine's cache first.
    """
    what = f"encoder `{name}`"
    own = networks.find(what, name)
    place = networks.set_up(what, device, threads)
    folder = own or networks.from_hub(what, name)
    network = networks.read(what, folder)
    try:
        preprocessing = read_preprocessing(network.preprocessor)
    except ValueError as error:
        problem = f"{what}, preprocessor_config.json: {documents.reason(error)}"
        raise EncoderError(f"{problem}; correct the file in a copy of the folder") from None
    network.model.to(place)
    dimension = _try(name, network, preprocessing.input_side, place)
    kind = ", classes" if network.is_classifier else ""
    label = f"{networks.label(own) if own else name} (transformers{kind})"
    # Prepared otherwise, it is another network.
    revision = f"{'' if own else folder.name} {preprocessing}"
    return TransformersEncoder(label, revision, dimension, preprocessing, network, place)


def describe(network: Network, images: Tensor, masks: Tensor) -> Floats:
    """Embed images (N, 3, I, I) float32 under masks (N, I, I) 0..1: (N, D) of unit norm."""
    inner, beliefs = network.model, None
    if network.is_classifier:
        inner = network.model.base_model
        outputs, scores = _with_base(network.model, images)
        beliefs = joint_embedding.material_beliefs(scores.float().cpu().numpy())
    else:
        outputs = inner(pixel_values=images)
    return joint_embedding.join(_features(inner, outputs, masks), beliefs)


def _features(network: Any, outputs: Any, masks: Tensor) -> Floats:  # noqa: ANN401 - any network
    """Average the last map of a network's outputs under masks (N, I, I) 0..1: (N, D).

    Without a spatial map the network's own pooled vector is returned.
    """
    import torch

    maps = getattr(outputs, "feature_maps", None)
    last = maps[-1] if maps else outputs.last_hidden_state
    if last.ndim not in (3, 4):
        last = outputs.pooler_output
    features = pool(last.float().cpu().numpy(), masks.cpu().numpy())
    final = getattr(network, "layernorm", None)
    if final is None or last.ndim != 4:  # tokens have been through it
        return features
    return np.asarray(final(torch.from_numpy(features).to(last.device)).float().cpu(), np.float32)


def _with_base(model: Any, images: Tensor) -> tuple[Any, Tensor]:  # noqa: ANN401
    """Run a classifier; return the outputs of the network below its last layer, and its scores."""
    outputs: list[Any] = []
    # Class scores and the map below them come from one pass: a hook keeps the output of the lower
    # part. Running that part by itself as well would double the time.
    handle = model.base_model.register_forward_hook(lambda *arguments: outputs.append(arguments[2]))
    try:
        scores = model(pixel_values=images).logits
    finally:
        handle.remove()
    return outputs[0], scores


def _try(name: str, network: Network, side: int, device: str) -> int:
    """Embed an empty picture; return the embedding's length. Raises EncoderError."""
    import torch

    blank = torch.zeros((1, 3, side, side), device=device)
    try:
        with torch.inference_mode():
            return len(describe(network, blank, blank[:, 0])[0])
    except Exception as error:  # noqa: BLE001 - each kind of network fails in its own way
        kind = type(network.model).__name__
        problem = f"encoder `{name}` is a {kind}, which cannot embed pictures ({short_line(error)})"
        raise EncoderError(f"{problem}; give an image network") from None
