"""Runs a vision-language model in this process and asks it for temperatures and materials.

A readout takes its answer from next-token probabilities in one forward pass that packs all wordings
and candidates (`numbers`). Not every network supports that. So after loading, a grey picture is
asked both packed and plainly, and a model is refused if the two results differ or are not numbers.
Knows no session and no ladder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hapticvlm import materials
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm import contract, weights
from hapticvlm.vlm.chat import Chat
from hapticvlm.vlm.contract import Picture, Vlm, VlmError, VlmSettings
from hapticvlm.vlm.limits import TRUST
from hapticvlm.vlm.network import Network
from hapticvlm.vlm.numbers import (
    ChoiceTree,
    beliefs,
    choice_tree,
    number_beliefs,
    number_tree,
    spread,
)
from hapticvlm.vlm.weights import Precision

CHECK_SIDE = 56  # px, the grey picture of the check at loading
# Largest total variation distance (half the sum of absolute differences over the vocabulary)
# between a packed pass and a plain one. Rounding stays below it, a wrong mask or position does not.
AGREEMENT = {"torch.bfloat16": 0.1, "torch.float32": 1e-3}


class LocalVlm:
    """A model of transformers behind the Vlm protocol."""

    def __init__(self, network: Network, chat: Chat, name: str) -> None:
        self.name = name
        self.chat = chat
        self.numbers = _tree(lambda: number_tree(chat.encode))
        self.network = network

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature from a picture (H, W, 3) uint8 RGB. Raises VlmError.

        A pass cannot be cancelled: a worker that takes too long is killed as a process.
        """
        start = time.monotonic()
        prompt = self.chat.prompt(contract.about_ambient(), [picture])
        log_probs = self.network.readout(prompt, self.numbers)
        wordings = [number_beliefs(self.numbers, row) for row in log_probs]
        reading = spread(wordings, time.monotonic() - start)
        low_c, high_c = contract.widened(reading.value_c, reading.low_c, reading.high_c)
        return replace(reading, low_c=low_c, high_c=high_c)

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask for the material of the outlined object, in one pass. Raises VlmError.

        Probability on `unknown`, and on words that are not among `names`, stays open.
        """
        tree = _tree(lambda: choice_tree(_spellings(names), self.chat.encode))
        prompt = self.chat.prompt(contract.about_material(names), [context, crop])
        probabilities = TRUST * beliefs(tree, self.network.readout(prompt, tree)[0])
        ranked = sorted(zip(names, probabilities.tolist(), strict=False), key=lambda item: -item[1])
        return Evidence("vlm", tuple(ranked))


def load_local(settings: VlmSettings, precision: Precision | None = None) -> LocalVlm:
    """Load a model by folder or name and check it on a grey picture. Raises VlmError.

    precision: of the weights; None for the faster one here that fits into memory.
    """
    vlm = LocalVlm(*weights.load(settings, precision), settings.model)
    _require_agreement(vlm)
    return vlm


def _require_agreement(vlm: LocalVlm) -> None:
    grey = np.full((CHECK_SIDE, CHECK_SIDE, 3), 127, np.uint8)
    prompt = vlm.chat.prompt(contract.about_ambient(), [grey])
    plain = vlm.network.following(prompt)
    packed = vlm.network.readout(prompt, vlm.numbers)[0, 0]
    distance = float(np.abs(np.exp(plain) - np.exp(packed)).sum()) / 2
    if not distance <= AGREEMENT[str(vlm.network.model.dtype)]:
        problem = (
            f"model `{vlm.name}` cannot be read in one pass (results differ by {distance:.2f})"
        )
        raise VlmError(f"{problem}; name another, or serve it elsewhere and give --vlm-url")


def _spellings(names: Sequence[str]) -> dict[str, int]:
    """Spell every name, and unknown after them, in lower case and capitalised."""
    listed = [*names, materials.UNKNOWN]
    capital = {name.capitalize(): place for place, name in enumerate(listed)}
    return {**capital, **{name: place for place, name in enumerate(listed)}}


def _tree(build: Callable[[], ChoiceTree]) -> ChoiceTree:
    try:
        return build()
    except ValueError as error:
        raise VlmError(f"the answers cannot be distinguished ({error})") from None


def load_vlm(settings: VlmSettings) -> Vlm:
    """Load a model, or use the endpoint at `url`. Raises VlmError."""
    if settings.url is not None:
        from hapticvlm.vlm.remote import RemoteVlm

        return RemoteVlm(settings)
    return load_local(settings)
