"""Several wordings and every candidate's beginning in one forward pass. Pure.

After the part that all share come, one behind the other, each wording's tail and the nodes of the
tree of candidates. A mask lets a token see what it would see if its wording and its beginning of a
candidate stood alone, and its position counts from the shared part, so the pass gives the very
next-token distributions that asking each text by itself would give (tree attention: Miao et al.,
SpecInfer, ASPLOS 2024, arXiv 2305.09781).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.vlm.choices import ChoiceTree


@dataclass(frozen=True, slots=True)
class Packed:
    """What follows the shared part, T tokens of K wordings with N nodes each.

    ids: (T,) int64. steps: (T,) int64, how far behind the shared part's end each stands, from 0.
    sees: (T, T) bool, row sees column. rows: (K, N) int64, where each node's next token is read.
    """

    ids: NDArray[np.int64]
    steps: NDArray[np.int64]
    sees: NDArray[np.bool_]
    rows: NDArray[np.int64]


def pack(tails: Sequence[Sequence[int]], tree: ChoiceTree) -> Packed:
    """Lay out the tails, each of one token or more, with the tree's nodes behind each."""
    size = sum(len(tail) + len(tree.nodes) - 1 for tail in tails)
    ids, steps = np.zeros(size, np.int64), np.zeros(size, np.int64)
    sees = np.eye(size, dtype=bool)
    rows = np.zeros((len(tails), len(tree.nodes)), np.int64)
    start = 0
    for tail, row in zip(tails, rows, strict=True):
        end = start + len(tail)
        ids[start:end], steps[start:end] = tail, np.arange(len(tail))
        sees[start:end, start:end] = np.tri(len(tail), dtype=bool)
        row[0] = end - 1
        for node in range(1, len(tree.nodes)):
            here = row[node] = end + node - 1
            above = row[tree.parent(node)]
            ids[here], steps[here] = tree.nodes[node][-1], steps[above] + 1
            sees[here] |= sees[above]
        start = end + len(tree.nodes) - 1
    return Packed(ids, steps, sees, rows)
