"""Every single fault on boards whose plate's thermistors lag, with three faces.

The night tries each fault with each lag on one face, another one for each lag; the faces take
turns, so that all of them are tried. `make sweep` tries all cases, before firmware is released.
"""

from __future__ import annotations

from collections.abc import Iterator

from .board import Build
from .faults import FAULTS, Fault

LAGS_S = (0.3, 1.0)
FACES_J_PER_K = (0.6, 1.0, 1.5)


def at_night() -> Iterator[tuple[Fault, Build]]:
    """Yield the cases of one night."""
    for number, lag_s in enumerate(LAGS_S):
        for at, fault in enumerate(FAULTS):
            yield fault, Build(lag_s, FACES_J_PER_K[(at + number) % len(FACES_J_PER_K)])
