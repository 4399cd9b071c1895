"""Which pattern comes when: in balanced blocks, or in a free random order.

Balanced: Latin squares in which every pattern follows every other equally often.
Williams (1949): the rows of a square of even order n can be chosen so that each pattern stands once
in every place and is preceded once by every other; an odd order needs the mirrored square beside
it. A block is one row, so a block presents each pattern once, and what a warm plate does to the
pattern after it falls on all alike. The end of a block can be guessed by who keeps count; a free
order has no blocks and no balance. Pure and seeded: the same study gives the same orders.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def square(patterns: int) -> list[list[int]]:
    """Williams' rows for this many patterns: n rows, or 2 n when n is odd."""
    zigzag = [(i + 1) // 2 if i % 2 else -(i // 2) for i in range(patterns)]
    rows = [[(start + step) % patterns for step in zigzag] for start in range(patterns)]
    return rows if patterns % 2 == 0 else rows + [row[::-1] for row in rows]


def free_orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials: every pattern `repeats` times, shuffled as a whole."""
    rng = np.random.default_rng(seed)
    trials = [name for name in names for _ in range(repeats)]
    return [tuple(trials[at] for at in rng.permutation(len(trials))) for _ in range(participants)]


def orders(
    names: Sequence[str], participants: int, repeats: int, seed: int
) -> list[tuple[str, ...]]:
    """Return each participant's trials in order, `repeats` blocks of all patterns.

    Rows are used up square by square, each square with labels and rows shuffled anew, so that
    every n blocks in a row are balanced, whoever felt them.
    """
    rng = np.random.default_rng(seed)
    blocks: list[tuple[str, ...]] = []
    while len(blocks) < participants * repeats:
        labels = [names[i] for i in rng.permutation(len(names))]
        rows = square(len(names))
        blocks += [tuple(labels[i] for i in rows[at]) for at in rng.permutation(len(rows))]
    return [
        tuple(name for block in blocks[at * repeats : (at + 1) * repeats] for name in block)
        for at in range(participants)
    ]
