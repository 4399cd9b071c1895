"""What is worth its cost among many ways to do a thing. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

T = TypeVar("T")


def pareto(ways: Iterable[T], cost: Callable[[T], float], worth: Callable[[T], float]) -> list[T]:
    """Return the ways that no cheaper one is as good as, cheapest first."""
    kept: list[T] = []
    for way in sorted(ways, key=lambda way: (cost(way), -worth(way))):
        if not kept or worth(way) > worth(kept[-1]):
            kept.append(way)
    return kept
