"""The rooms, palms and setpoints in which every fault is tried: the extremes of a scene.

A fault strikes a plate that moves, or one that has held its extreme for a minute. On a moving one
the loop works hardest; on a held one the skin, the sink and everything that stores charge or heat
are as near to a limit as they get.
"""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm.devices.simulated.plant import PALM_RESISTANCE, Plant
from hapticvlm.perception import NEUTRAL_C

BEFORE_S = 3.0  # a second after the plate began to move towards the extreme
HELD_S = 60.0
PRESSED = 5e-5  # m2 K/W, of a palm pressed on the plate


@dataclass(frozen=True)
class Situation:
    """A room, a palm, and the setpoint to which the host returns; a fault strikes `faulty_at_s`.

    `palm_resistance` is in m2 K/W.
    """

    name: str
    ambient_c: float
    extreme_c: float
    faulty_at_s: float = BEFORE_S
    palm_resistance: float = PALM_RESISTANCE

    @property
    def busy_s(self) -> float:
        """Time after which the setpoint no longer changes and the fault has had 12 s to show."""
        return self.faulty_at_s + 12.0

    def setpoint_c(self, elapsed_s: float) -> float:
        """Return the setpoint: rest, the extreme, after a fault half way back, the extreme."""
        if elapsed_s < 2.0:
            return NEUTRAL_C
        since_s = elapsed_s - self.faulty_at_s
        return (NEUTRAL_C + self.extreme_c) / 2.0 if 5.0 <= since_s < 8.0 else self.extreme_c


HOT = Situation("hot, warm room", 30.0, 40.0)
COLD = Situation("cold, cool room", 15.0, 18.0)
COLD_WARM = Situation("cold, warm room", 30.0, 18.0)  # the largest load of the sink
HELD_HOT = Situation("held hot", 30.0, 40.0, HELD_S, PRESSED)
HELD_COLD = Situation("held cold", 15.0, 18.0, HELD_S, PRESSED)
MOVING = (HOT, COLD, COLD_WARM)
HELD = (HELD_HOT, HELD_COLD)
SITUATIONS = (*MOVING, *HELD)


def hold_for_a_minute(plant: Plant, goal_c: float, coolest_a: float, hottest_a: float) -> None:
    """Bring a plate to its goal by a loop of no board, slow and steady, within these currents."""
    integral_a = 0.0
    for _ in range(1200):
        error_c = goal_c - plant.plate_c
        integral_a = min(max(integral_a + 0.03 * error_c, coolest_a), hottest_a)
        plant.step(min(max(integral_a + error_c, coolest_a), hottest_a), 0.05)
