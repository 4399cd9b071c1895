"""From beliefs in whole degrees to a temperature with its interval. Pure; knows no model.

A belief in n degC is spread evenly over n - 0.5 to n + 0.5, so quantiles are continuous and a model
that is sure of one number still leaves the degree it rounds to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.vlm.answers import COVERAGE, LEAST_C, MOST_C, VlmError
from hapticvlm.recognition.vlm.choices import ChoiceTree, Encode, choice_tree

CANDIDATES_C = np.arange(LEAST_C, MOST_C + 1)  # degC
LEAST_SHARE = 1e-6  # probability of any number at all below which a readout is rounding noise

Beliefs = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Spread:
    """A temperature, the interval that holds COVERAGE of the belief, all degC, and two doubts.

    prompt_sd_c: standard deviation of the value over the wordings, None with one. share: the
    probability that the answer is a candidate at all, mean over the wordings.
    """

    value_c: float
    low_c: float
    high_c: float
    prompt_sd_c: float | None
    share: float


def number_tree(encode: Encode) -> ChoiceTree:
    """Build the tree of all candidate numbers, for any tokenizer. Raises ValueError."""
    spellings = {str(number): place for place, number in enumerate(CANDIDATES_C.tolist())}
    return choice_tree(spellings, encode)


def spread(wordings: Sequence[Beliefs]) -> Spread:
    """Average beliefs in CANDIDATES_C, each (91,) summing to at most 1, over the wordings.

    Each wording counts the same, whatever its share. Raises VlmError where no number is believed.
    """
    shares = [float(one.sum()) for one in wordings]
    if not min(shares, default=0.0) >= LEAST_SHARE:
        raise VlmError("the model's answer begins with no number: is it an instruct model?")
    normal = [one / share for one, share in zip(wordings, shares, strict=True)]
    means = [float(one @ CANDIDATES_C) for one in normal]
    mixed: Beliefs = np.mean(normal, axis=0)
    tail, value_c = (1.0 - COVERAGE) / 2, float(np.mean(means))
    return Spread(
        value_c=value_c,
        low_c=min(quantile(mixed, tail), value_c),  # a far second opinion draws the mean outside
        high_c=max(quantile(mixed, 1.0 - tail), value_c),
        prompt_sd_c=float(np.std(means, ddof=1)) if len(means) > 1 else None,
        share=float(np.mean(shares)),
    )


def quantile(normal: Beliefs, level: float) -> float:
    """Find the temperature below which `level` (0..1) of beliefs that sum to 1 lies; degC."""
    edges = np.append(CANDIDATES_C - 0.5, MOST_C + 0.5)
    below = np.concatenate([[0.0], np.cumsum(normal)])
    return float(np.interp(level * below[-1], below, edges))
