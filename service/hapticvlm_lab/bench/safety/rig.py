"""The compiled core on the plant, closed loop: what a script does to a plate, and when it is off.

Cores that differ only in a guard do the same until one of them trips, so they share one plant: the
first that has not tripped drives it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.devices.faults import names
from hapticvlm.devices.plate.protocol import Setpoint
from hapticvlm_lab.bench.safety.core import STEP_S, Core, sum_at
from hapticvlm_lab.bench.safety.variations import Variation

Sums = tuple[int, int, int]
RENEW_STEPS = 5
CLOSED_STEPS = 15  # 0.3 s: until the cut-out of firmware/hosttests/library.cpp has closed
TTL_MS = 250
NOISE = 4.0  # standard deviation of a sum: one count a conversion, an assumption


@dataclass(frozen=True, slots=True)
class Phase:
    """For so long this setpoint; `lie` turns what the thermistors read into what the board sees."""

    seconds: float
    setpoint_c: float
    has_palm: bool = True
    lie: Callable[[Sums], Sums] | None = None
    polarity: int = 1


@dataclass(frozen=True, slots=True)
class Outcome:
    """Hottest and coldest true plate until off; faults and time since the last phase began."""

    peak_c: float
    coldest_c: float
    faults: tuple[str, ...]
    off_after_s: float | None


class Rig:
    """Cores on one plate, to be used once."""

    def __init__(self, cores: Sequence[Core], variation: Variation, seed: int) -> None:
        self._cores = list(cores)
        self._variation = variation
        self._plant = variation.plant()
        self._rng = np.random.default_rng(seed)
        self._outcomes: dict[int, Outcome] = {}
        self._hottest_c = -math.inf
        self._coldest_c = math.inf
        # A board drives only after it has seen its cut-out open once and then closed, which the
        # core built for this chart plays in its first 200 ms: nothing may be asked of it before.
        resting = self._sums(np.zeros(3))
        for core in cores:
            core.start()
            for _ in range(CLOSED_STEPS):
                core.step(resting)

    def run(self, script: Sequence[Phase]) -> list[Outcome]:
        """Run phases in order until every core is off; one outcome a core, in order."""
        for phase in script:
            resistance = self._variation.palm_resistance if phase.has_palm else math.inf
            self._plant.touch(resistance)
            self._run(phase)
        left = Outcome(self._hottest_c, self._coldest_c, (), None)
        return [self._outcomes.get(number, left) for number in range(len(self._cores))]

    def _run(self, phase: Phase) -> None:
        steps = round(phase.seconds / STEP_S)
        noise = self._rng.normal(0.0, NOISE, (steps, 3))
        for step in range(steps):
            running = [
                (number, core)
                for number, core in enumerate(self._cores)
                if number not in self._outcomes
            ]
            if not running:
                return
            if step % RENEW_STEPS == 0:
                for _, core in running:
                    core.send(Setpoint(round(phase.setpoint_c * 1000.0), TTL_MS))
            sums = self._sums(noise[step])
            seen = sums if phase.lie is None else phase.lie(sums)
            self._step(running, seen, (step + 1) * STEP_S, phase.polarity)

    def _step(
        self, running: list[tuple[int, Core]], sums: Sums, since_s: float, polarity: int
    ) -> None:
        current_a = 0.0
        for number, core in reversed(running):
            driven_a = core.step(sums)
            latched = core.fault_bits()
            if latched:
                outcome = Outcome(self._hottest_c, self._coldest_c, names(latched), since_s)
                self._outcomes[number] = outcome
            else:
                current_a = driven_a
        self._plant.step(current_a * polarity * self._variation.supply, STEP_S)
        self._hottest_c = max(self._hottest_c, self._plant.plate_c)
        self._coldest_c = min(self._coldest_c, self._plant.plate_c)

    def _sums(self, noise: np.ndarray) -> Sums:
        first, second, sink = self._variation.offsets_c
        plate_c = self._plant.plate_c
        sink_c = self._plant.sink_c
        return (
            round(sum_at(plate_c + first) + noise[0]),
            round(sum_at(plate_c + second) + noise[1]),
            round(sum_at(sink_c + sink) + noise[2]),
        )
