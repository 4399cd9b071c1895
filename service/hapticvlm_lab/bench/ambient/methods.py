"""The methods to ask a vision-language model that the chart compares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from hapticvlm.vlm.contract import VlmSettings
from hapticvlm.vlm.limits import IMAGE_TOKENS
from hapticvlm.vlm.weights import Precision

Family = Literal["readout", "generation", "remote", "wire"]

BUDGETS = (64, 128, 256)  # image tokens
REPLY = "21"  # of the stand-in endpoint


@dataclass(frozen=True, slots=True)
class Method:
    """A method to ask, by its name. `settings` of the wire name no url yet.

    precision: of the weights in process.
    """

    name: str
    family: Family
    settings: VlmSettings
    is_default: bool = False
    precision: Precision = "bfloat16"


def in_process(model: str, device: str, budgets: Sequence[int] = BUDGETS) -> list[Method]:
    """Readout at every budget, then generation and the other precision at the default's."""
    base = VlmSettings(model=model, device=device)
    methods = []
    for tokens in budgets:
        settings = replace(base, image_tokens=tokens)
        is_default = tokens == IMAGE_TOKENS
        methods.append(Method(f"readout, {tokens} tokens, bf16", "readout", settings, is_default))
    methods.append(Method(f"generation, {IMAGE_TOKENS} tokens, bf16", "generation", base))
    exact = Method(
        f"readout, {IMAGE_TOKENS} tokens, fp32",
        "readout",
        base,
        is_default=False,
        precision="float32",
    )
    return [*methods, exact]


def remote(url: str, model: str | None, token: str | None) -> Method:
    """Ask an endpoint of the user's."""
    settings = VlmSettings(url=url, token=token, timeout_s=120.0)
    named = settings if model is None else replace(settings, model=model)
    return Method("remote", "remote", named)


def wire() -> Method:
    """Ask an endpoint on loopback that answers at once: what a remote question costs at least."""
    return Method("remote: the wire alone", "wire", VlmSettings(model="stand-in"))
