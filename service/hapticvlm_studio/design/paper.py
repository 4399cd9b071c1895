"""Holds the published data of the HapticVLM paper's study (arXiv 2505.02569).

Nine people answered 450 trials of ten patterns. The paper prints its confusion matrix as
proportions with two decimals; each row corresponds to exactly one row of integers that sum to 45
(docs/physics.md 6.1), and those counts are kept here. Single people's trials are unpublished. The
paper does not print F. It is recovered as the value with two decimals that gives both the printed p
and the printed effect size.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PARTICIPANTS = 9
REPEATS = 5
VIBRATIONS = (
    "wood carving",
    "glass tapping",
    "wood striking",
    "fabric rubbing",
    "metal whooshing",
)
SHORT = ("WC", "GT", "WS", "FR", "MW")
TEMPERATURES = ("hot", "cold")
CODES = tuple(f"{short}-{warmth[0]}" for warmth in TEMPERATURES for short in SHORT)
KEY = "WC wood carving, GT glass tapping, WS wood striking, FR fabric rubbing, MW metal whooshing; \
h hot, c cold"

_COUNTS = (
    (45, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    (0, 42, 3, 0, 0, 0, 0, 0, 0, 0),
    (0, 2, 37, 3, 0, 0, 0, 1, 0, 2),
    (0, 0, 1, 36, 7, 0, 0, 0, 1, 0),
    (4, 0, 0, 3, 36, 0, 0, 1, 1, 0),
    (3, 0, 0, 0, 0, 42, 0, 0, 0, 0),
    (0, 2, 0, 0, 0, 1, 36, 6, 0, 0),
    (0, 0, 4, 1, 0, 0, 0, 35, 3, 2),
    (0, 0, 0, 1, 0, 0, 1, 3, 34, 6),
    (0, 0, 0, 0, 2, 0, 0, 1, 4, 38),
)


def confusion() -> NDArray[np.int64]:
    """Return how often each pattern (rows) was answered as each (columns), (10, 10).

    Both are in the order of CODES, the five hot patterns first; rows sum to 45.
    """
    return np.array(_COUNTS, dtype=np.int64)


# Effect, recovered F, printed degrees of freedom, those of a 5 x 2 design of nine people, printed
# p.
PRINTED = (
    ("vibration", 1.92, (9, 72), (4, 32), 0.0625),
    ("temperature", 2.59, (1, 8), (1, 8), 0.146),
    ("vibration x temperature", 1.05, (9, 72), (4, 32), 0.410),
)
NOTES = (
    "F(9, 72) belongs to one factor of ten levels and nine people. The study crosses five "
    "vibrations with two temperatures, for which vibration and interaction have F(4, 32); crossing "
    "ten patterns with temperature is degenerate, because temperature is already in the pattern.",
    "Printed p and partial eta squared agree with the printed F, so the figures are consistent "
    "with each other; only the label of the design is not.",
    "0.193 and 0.244 are called medium; by the usual limit of 0.14 they are large. That the "
    "differences among nine people are not significant does not show that patterns are recognised "
    "alike.",
    "'None significant, all corrected p = 1.000' cannot follow from these counts by pooled tests: "
    "wood carving hot is correct 45 of 45 times, fabric rubbing cold 34 of 45. A test by person "
    "could still give that result; it cannot be repeated from the table.",
    "The mean of the printed cells is 84.6 %, of the counts 84.67 %; the difference is rounding. "
    "This is how well people distinguished patterns; the paper gives no accuracy of its vision "
    "module.",
    "To run the ANOVA, the pairwise tests by person and an interval that respects people, each "
    "person's trials are needed: participant, presented and answered pattern, in order. Reaction "
    "times, levels, setpoints and whether sound was masked are not given either.",
)
