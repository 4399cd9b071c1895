"""One pipeline's row, and which rows are worth their cost. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hapticvlm_lab.bench.pareto import pareto

STATED = "every material stated"  # the ceiling: it costs its author, not the machine


@dataclass(frozen=True, slots=True)
class Row:
    """One pipeline on one source of n objects.

    `share` felt as what they are (predicted), with its 95 % interval (Wilson); mean differences
    from the true material; ms of one core for a look (median; a frame is decoded and cut) and for
    a touch of one second (least of several, in turns); `mb` that an eye adds; `worst` the material
    least often felt.
    """

    source: str
    decides: str
    renders: str
    is_default: bool
    n: int
    share: float
    low: float
    high: float
    skin_c: float
    texture_db: float
    look_ms: float
    touch_ms: float
    mb: float
    worst: str

    @property
    def core_ms(self) -> float:
        """One look and one touch."""
        return self.look_ms + self.touch_ms

    @property
    def name(self) -> str:
        """How it decides, and what it renders otherwise."""
        return f"{self.decides}; {self.renders}" if self.renders else self.decides


def undominated(rows: Sequence[Row]) -> list[Row]:
    """Return the rows that no cheaper one is as good as, cheapest first; STATED is left out."""
    machines = [row for row in rows if row.decides != STATED]
    return pareto(machines, lambda row: row.core_ms, lambda row: row.share)
