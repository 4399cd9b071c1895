"""What a vision-language model is asked here, and what it answers. Knows no model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import HapticVLMError
from hapticvlm.recognition.ladder import Evidence

DEFAULT_MODEL = "Qwen/Qwen2-VL-2B-Instruct"
LEAST_C, MOST_C = -30, 60  # degC, the candidate numbers, each whole degree
COVERAGE = 0.8  # share of the belief that lies inside an interval

Method = Literal["readout", "generation", "decision", "logprobs", "text"]
Precision = Literal["bfloat16", "float32"]
Picture = NDArray[np.uint8]


class VlmError(HapticVLMError):
    """The model cannot be loaded or asked, or its answer is of no use; the text is the reason."""


@dataclass(frozen=True, slots=True)
class Reading:
    """An ambient temperature read off a picture, degC, with the interval that holds COVERAGE.

    `prompt_sd_c` is the standard deviation of the value over the wordings asked, None with one.
    `share` is the probability that the answer is one of the candidate numbers at all, None where
    the method sees no probabilities.
    """

    value_c: float
    low_c: float
    high_c: float
    prompt_sd_c: float | None
    method: Method
    seconds: float
    share: float | None = None


@dataclass(frozen=True, slots=True)
class VlmSettings:
    """Which model to ask and how. With a `url` it is asked over HTTP, else loaded in process.

    `image_tokens` is the speed knob: the most tokens a picture may become. `wordings` is over how
    many prompts the answer is averaged. A `token` is sent to the endpoint as a bearer token.
    `precision` is that of the weights in process, None for the faster
    one here that fits into memory.
    """

    model: str = DEFAULT_MODEL
    url: str | None = None
    token: str | None = field(default=None, repr=False)
    device: str = "cpu"
    threads: int = 1
    image_tokens: int = 64
    wordings: int = 2
    method: Method | None = None
    timeout_s: float = 30.0
    precision: Precision | None = None


class Vlm(Protocol):
    """A loaded model or an endpoint. Calls block; the caller is a process of its own."""

    @property
    def name(self) -> str:
        """Which model it is, as the settings name it."""

    @property
    def is_remote(self) -> bool:
        """Whether pictures leave this machine."""

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError."""

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask what the object is made of; evidence of rung vlm over `names`. Raises VlmError.

        `context` is the frame with the object outlined, `crop` the object, both (H, W, 3) uint8.
        """

    def close(self) -> None:
        """Release the model or the connection."""
