"""What the thermal chart shows of each method."""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm_lab.bench.thermal.methods import Family


@dataclass(frozen=True, slots=True)
class Row:
    """One method: worst errors in degC and where, cost in us; None is no number at all.

    `felt_c` is the worst on one contact, `slide_c` over slides; `step_us` and `setup_us` are
    medians, `touch_us` a step of a touch of one second with its share of setting up, `floors`
    that over a bare evaluation of the closed form in the same run.
    """

    method: str
    family: Family
    is_default: bool
    felt_c: float | None
    felt_at: str
    slide_c: float | None
    slide_at: str
    step_us: float
    setup_us: float
    touch_us: float
    floors: float
