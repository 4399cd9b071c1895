"""An ambient temperature that was read off a picture, with its interval. Knows no model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

COVERAGE = 0.8  # share of the belief that lies inside an interval

Method = Literal["readout", "logprobs", "text"]


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
