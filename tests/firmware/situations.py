"""The rooms and setpoints in which every fault is tried: the extremes that a scene may request."""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm.perception import NEUTRAL_C

BUSY_S = 15.0  # until then the setpoint changes


@dataclass(frozen=True)
class Situation:
    """A room, and the setpoint to which the host returns."""

    name: str
    ambient_c: float
    extreme_c: float

    def setpoint_c(self, elapsed_s: float) -> float:
        """Return the setpoint: rest, the extreme, half way back, then the extreme permanently."""
        if elapsed_s < 2.0:
            return NEUTRAL_C
        return (NEUTRAL_C + self.extreme_c) / 2.0 if 8.0 <= elapsed_s < 11.0 else self.extreme_c


HOT = Situation("hot, warm room", 30.0, 40.0)
COLD = Situation("cold, cool room", 15.0, 18.0)
COLD_WARM = Situation("cold, warm room", 30.0, 18.0)  # the largest load of the sink
SITUATIONS = (HOT, COLD, COLD_WARM)
