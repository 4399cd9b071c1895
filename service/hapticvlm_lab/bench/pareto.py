"""The methods worth their cost among many. Pure.

A method is dominated if another is at most as dear and at least as good. Whoever chooses by cost
and worth alone never needs a dominated method, whatever a unit of worth may cost; those that are
left form the Pareto front.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


def pareto(ways: Iterable[T], cost: Callable[[T], float], worth: Callable[[T], float]) -> list[T]:
    """Return the methods that no cheaper one equals in worth, cheapest first."""
    # From the cheapest on, a method is kept if it is better than every cheaper one, which is the
    # last one kept.
    kept: list[T] = []
    for way in sorted(ways, key=lambda way: (cost(way), -worth(way))):
        if not kept or worth(way) > worth(kept[-1]):
            kept.append(way)
    return kept
