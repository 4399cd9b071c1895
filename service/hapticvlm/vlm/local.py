"""A vision-language model in this process, asked for temperatures and materials; `load_vlm`.

A readout takes its answer from next-token probabilities in one pass. When loaded, a model is asked
about a grey picture in the packed way and plainly, and refused where the two differ or give what is
no number. Knows no session and no ladder.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from collections.abc import Callable, Sequence

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

# Threads of OpenMP that wait by spinning take the cores from the gateway and from each other:
# with a third busy process on two cores a pass was seen to take eight times as long.
PASSIVE = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "0"}
CHECK_SIDE = 56  # px, the grey picture of the check at loading
# Largest difference in probability, summed over the vocabulary and halved, between a packed pass
# and a plain one: rounding of bfloat16 alone; a wrong mask or position moves far more.
AGREEMENT: dict[Precision, float] = {"bfloat16": 0.1, "float32": 1e-3}


class LocalVlm:
    """A model of transformers behind the Vlm protocol."""

    is_remote = False

    def __init__(self, network: Network, chat: Chat, name: str) -> None:
        self.name = name
        self.chat = chat
        self.numbers = _tree(lambda: number_tree(chat.encode))
        self._network: Network | None = network

    @property
    def network(self) -> Network:
        """The network, until `close`. Raises VlmError."""
        if self._network is None:
            raise VlmError("the model was closed")
        return self._network

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError.

        A pass cannot be broken off: a worker that takes too long is ended as a process.
        """
        start = time.monotonic()
        prompt = self.chat.prompt(contract.about_ambient(), [picture])
        log_probs = self.network.readout(prompt, self.numbers)
        found = spread([number_beliefs(self.numbers, row) for row in log_probs])
        low_c, high_c = contract.widened(found.value_c, found.low_c, found.high_c)
        return Reading(
            value_c=found.value_c,
            low_c=low_c,
            high_c=high_c,
            prompt_sd_c=found.prompt_sd_c,
            method="readout",
            seconds=time.monotonic() - start,
            share=found.share,
        )

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask what the outlined object is made of, in one pass. Raises VlmError.

        What the model leaves to `unknown` and to words that are no name stays open.
        """
        tree = _tree(lambda: choice_tree(_spellings(names), self.chat.encode))
        prompt = self.chat.prompt(contract.about_material(names), [context, crop])
        found = TRUST * beliefs(tree, self.network.readout(prompt, tree)[0])
        ranked = sorted(zip(names, found.tolist(), strict=False), key=lambda item: -item[1])
        return Evidence("vlm", tuple(ranked))

    def close(self) -> None:
        """Release the model."""
        self._network = None
        gc.collect()


def load_local(settings: VlmSettings, precision: Precision | None = None) -> LocalVlm:
    """Load a model by folder or name and check it on a grey picture. Raises VlmError.

    precision: of the weights; None for the faster one here that fits into memory.
    """
    weights.find_here(settings.model)  # a slip in the path is said before torch is imported
    precision = precision or weights.faster_precision(settings)
    vlm = LocalVlm(*weights.load(settings, precision), settings.model)
    _require_agreement(vlm, precision)
    return vlm


def _require_agreement(vlm: LocalVlm, precision: Precision) -> None:
    grey = np.full((CHECK_SIDE, CHECK_SIDE, 3), 127, np.uint8)
    prompt = vlm.chat.prompt(contract.about_ambient(), [grey])
    plain = vlm.network.following(prompt)
    packed = vlm.network.readout(prompt, vlm.numbers)[0, 0]
    apart = float(np.abs(np.exp(plain) - np.exp(packed)).sum()) / 2
    if not apart <= AGREEMENT[precision]:
        text = f"model `{vlm.name}` cannot be read in one pass (it differs by {apart:.2f})"
        raise VlmError(f"{text}; name another, or serve it elsewhere and give --vlm-url")


def _spellings(names: Sequence[str]) -> dict[str, int]:
    """Spell every name, and unknown behind them, in small letters and capitalised."""
    listed = [*names, materials.UNKNOWN]
    capital = {name.capitalize(): place for place, name in enumerate(listed)}
    return {**capital, **{name: place for place, name in enumerate(listed)}}


def _tree(build: Callable[[], ChoiceTree]) -> ChoiceTree:
    try:
        return build()
    except ValueError as error:
        raise VlmError(f"the answers cannot be told apart ({error})") from None


def prepare_process(threads: int) -> bool:
    """Make waiting threads sleep in this process; False when torch was imported before: too late.

    OpenMP reads these when torch is imported, so a process that is to load a model calls this, or
    load_vlm, first.
    """
    for name, value in {**PASSIVE, "OMP_NUM_THREADS": str(threads)}.items():
        os.environ.setdefault(name, value)
    return "torch" not in sys.modules


def load_vlm(settings: VlmSettings) -> Vlm:
    """Load a model, or connect to the endpoint at `url`. Raises VlmError."""
    if settings.url is not None:
        from hapticvlm.vlm.remote import RemoteVlm

        return RemoteVlm(settings)
    prepare_process(settings.threads)
    return load_local(settings)
