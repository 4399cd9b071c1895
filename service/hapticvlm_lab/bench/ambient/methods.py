"""The methods to ask a vision-language model that the chart compares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from hapticvlm.vlm.contract import VlmSettings

Family = Literal["readout", "generation", "remote", "wire"]

BUDGETS = (64, 128, 256)  # image tokens
REPLY = "21"  # of the stand-in endpoint


@dataclass(frozen=True, slots=True)
class Method:
    """A method to ask, by its name. `settings` of the wire name no url yet."""

    name: str
    family: Family
    settings: VlmSettings
    is_default: bool = False


def in_process(model: str, device: str, budgets: Sequence[int] = BUDGETS) -> list[Method]:
    """Readout at every budget, then generation and the other precision at the default's."""
    base = VlmSettings(model=model, device=device, precision="bfloat16")
    methods = []
    for tokens in budgets:
        settings = replace(base, image_tokens=tokens, method="readout")
        is_default = tokens == base.image_tokens
        methods.append(Method(f"readout, {tokens} tokens, bf16", "readout", settings, is_default))
    generating = replace(base, method="generation", wordings=1, timeout_s=600.0)
    methods.append(
        Method(f"generation, {base.image_tokens} tokens, bf16", "generation", generating)
    )
    exact = replace(base, precision="float32", method="readout")
    methods.append(Method(f"readout, {base.image_tokens} tokens, fp32", "readout", exact))
    return methods


def remote(url: str, model: str | None, token: str | None) -> Method:
    """Ask an endpoint of the user's."""
    settings = VlmSettings(url=url, token=token, timeout_s=120.0)
    named = settings if model is None else replace(settings, model=model)
    return Method("remote", "remote", named)


def wire() -> Method:
    """Ask an endpoint on loopback that answers at once: what a remote question costs at least."""
    return Method("remote: the wire alone", "wire", VlmSettings(model="stand-in", wordings=1))
