"""Defines the reading of an ambient temperature from a picture. Knows no model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

COVERAGE = 0.8  # share of the belief that lies inside an interval

Method = Literal["readout", "text"]


@dataclass(frozen=True, slots=True)
class Reading:
    """An ambient temperature read from a picture, degC, with the interval that holds COVERAGE.

    `prompt_sd_c` is the standard deviation of the value over the wordings; None with one. `share`
    is the probability that the answer is a candidate number at all; None if the method has no
    probabilities. `seconds` is how long the reading took.
    """

    value_c: float
    low_c: float
    high_c: float
    prompt_sd_c: float | None
    method: Method
    seconds: float
    share: float | None = None
