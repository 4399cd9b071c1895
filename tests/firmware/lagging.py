"""Every single fault on boards whose plate's thermistors lag, with three faces.

The night tries every third pair of fault and face, another third for each lag, so that every fault
meets some lag. `make sweep` tries all of them, before firmware is released.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from .board import Build
from .faults import FAULTS, Fault

LAGS_S = (0.3, 1.0)
FACES_J_PER_K = (0.6, 1.0, 1.5)
EVERY = 3


def at_night() -> Iterator[tuple[Fault, Build]]:
    """Yield the cases of one night."""
    for number, lag_s in enumerate(LAGS_S):
        cases = list(itertools.product(FAULTS, FACES_J_PER_K))
        for fault, face in cases[number::EVERY]:
            yield fault, Build(lag_s, face)
