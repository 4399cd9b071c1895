"""What gateway and audio engine exchange: orders and a persistent state one way, a status back."""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm.rendering.vibration.voices import Command


@dataclass(frozen=True, slots=True)
class Release:
    """Fade one hand."""

    hand: int


@dataclass(frozen=True, slots=True)
class RestAll:
    """Fade everything."""


@dataclass(frozen=True, slots=True)
class PersistentState:
    """What holds until it is changed, however many orders were lost; newest value only.

    `gain` is 0..1; `rested` numbers the newest order to rest everything, 0 = none.
    """

    # Orders may be lost: a gateway that outruns a stopped engine writes over the oldest. For a blow
    # that is right, a late one is worse than none. A gain or a stop must not be lost, so both stand
    # beside the ring as a state, which the engine compares with what it has done.
    gain: float
    rested: int


Order = Command | Release | RestAll


@dataclass(frozen=True, slots=True)
class EngineStatus:
    """What the engine reports each block; times are seconds on the monotonic clock."""

    beat_at: float
    level: float
    underruns: int
    lost: int
    scrubbed: int
    samples: int
    newest: int
    realtime: bool
    has_output: bool = True
