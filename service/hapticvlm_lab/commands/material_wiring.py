"""What the charts of materials compare: labels of the data folder, and networks in torch.

Wires the measurements to the training side, which they do not import.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hapticvlm.recognition.encoders.encoder import Encoder
    from hapticvlm_lab.bench.material.data import Labels
    from hapticvlm_lab.bench.material.methods import Wiring
    from hapticvlm_lab.training.network import Network

WEIGHTS = "encoder.safetensors"
OF_SHIPPED = Path(__file__).parents[1] / "training"  # the weights of the encoder that ships
SEED = 7  # of the untrained network


def labels() -> Labels:
    """Return what the data folder's labels mean."""
    from hapticvlm_lab.bench.material.data import Labels
    from hapticvlm_lab.training import sources

    return Labels(
        sources.LABELLED,
        sources.CALIBRATION,
        sources.material_of,
        sources.is_tile_held_back,
        sources.LIVING_HELD_BACK,
    )


def wiring() -> Wiring:
    """Return what the chart of materials is wired to."""
    from hapticvlm_lab.bench.material.methods import Wiring

    return Wiring(labels(), _eager, _untrained)


def networks(data: Path | None) -> list[str]:
    """List the ImageNet networks of the data folder."""
    return [] if data is None else sorted(map(str, data.glob("teacher/*.tflite")))


def _eager(folder: Path | None) -> Encoder:
    """Load the same net in torch eager, from the weights beside its graph. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import CARD, SHIPPED, EncoderError

    weights, place = folder or OF_SHIPPED, folder or SHIPPED
    if not (weights / WEIGHTS).is_file() or not (place / CARD).is_file():
        raise EncoderError(f"no {WEIGHTS} for {CARD} in {place.name}")
    return _in_torch("torch eager", _card(place), lambda: _read_network(weights))


def _untrained() -> Encoder:
    """Make the shipped architecture with random weights. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import CARD, SHIPPED

    card: dict[str, Any] = {"side": 128, "shape": {}}
    card = _card(SHIPPED) if (SHIPPED / CARD).is_file() else card
    return _in_torch("untrained", card, lambda: _random_network(card["shape"]))


def _card(place: Path) -> dict[str, Any]:
    from hapticvlm.recognition.encoders.encoder import CARD

    card: dict[str, Any] = json.loads((place / CARD).read_text(encoding="utf-8"))
    return card


def _read_network(place: Path) -> Network:
    from hapticvlm_lab.training import export

    return export.read(place)


def _random_network(shape: dict[str, Any]) -> Network:
    import torch

    from hapticvlm_lab.training.network import Network, Shape

    torch.manual_seed(SEED)
    return Network(Shape(**shape)).eval()


def _in_torch(name: str, card: dict[str, Any], make: Callable[[], Network]) -> Encoder:
    """Wrap a training network, run by torch on one thread, as an encoder. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import EncoderError
    from hapticvlm_lab.bench.material import baselines

    try:
        import torch

        torch.set_num_threads(1)
        network = make()
    except (ImportError, RuntimeError, TypeError, KeyError) as error:
        raise EncoderError(f"{error}".splitlines()[0]) from None

    def forward(pixels: Any) -> Any:  # noqa: ANN401 - arrays in, arrays out
        with torch.inference_mode():
            return network(torch.from_numpy(pixels)).numpy()

    return baselines.Network(name, card["side"], network.shape.dimension, forward)
