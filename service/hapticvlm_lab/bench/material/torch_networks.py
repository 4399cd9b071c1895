"""The shipped network, and one of its shape that learned nothing, run by torch on one thread."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.vision.encoders.encoder import CARD, SHIPPED, Encoder, EncoderError
from hapticvlm_lab import training
from hapticvlm_lab.bench.material import baselines

if TYPE_CHECKING:
    from hapticvlm_lab.training.network import Network

TRAINED = Path(training.__file__).parent  # keeps the weights of the encoder that ships
WEIGHTS = "encoder.safetensors"
SEED = 7  # of the untrained network


def eager() -> Encoder:
    """Load the shipped net in torch eager, from its trained weights. Raises EncoderError."""
    if not (TRAINED / WEIGHTS).is_file():
        raise EncoderError(f"no {WEIGHTS} in {TRAINED}")
    return _in_torch("torch eager", _read_network)


def untrained() -> Encoder:
    """Make the shipped architecture with random weights. Raises EncoderError."""
    return _in_torch("untrained", _random_network)


def _read_network(_: dict[str, Any]) -> Network:
    from hapticvlm_lab.training import export

    return export.read(TRAINED)


def _random_network(card: dict[str, Any]) -> Network:
    import torch

    from hapticvlm_lab.training.network import Network, Shape

    torch.manual_seed(SEED)
    return Network(Shape(**card["shape"])).eval()


def _in_torch(name: str, make: Callable[[dict[str, Any]], Network]) -> Encoder:
    """Wrap a network made by the shipped one's card as an encoder. Raises EncoderError."""
    card: dict[str, Any] = json.loads((SHIPPED / CARD).read_text(encoding="utf-8"))
    try:
        import torch

        torch.set_num_threads(1)
        network = make(card)
    except (ImportError, RuntimeError, TypeError, KeyError) as error:
        raise EncoderError(f"{error}".splitlines()[0]) from None

    def forward(pixels: Any) -> Any:  # noqa: ANN401 - arrays in, arrays out
        with torch.inference_mode():
            return network(torch.from_numpy(pixels)).numpy()

    return baselines.Network(name, card["side"], network.shape.dimension, forward)
