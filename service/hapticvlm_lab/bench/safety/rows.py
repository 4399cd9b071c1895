"""What the safety chart shows of each setting and each fault."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One setting over all plates: thermistors that freeze, and sound plates switched off."""

    window_ms: int
    duty_cap: float
    is_default: bool
    peak_median_c: float
    peak_worst_c: float
    above_trip: float
    false_trips: float
    false_by: dict[str, int]


@dataclass(frozen=True, slots=True)
class Off:
    """How long after a fault the plate was off; None is never within the trial."""

    fault: str
    off_s: float | None
    guard: str
