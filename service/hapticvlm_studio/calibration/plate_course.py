"""A plate that swings for `calibrate plate`, and what it reports of itself meanwhile."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hapticvlm.devices import faults
from hapticvlm.devices.errors import DeviceError
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import PlateReading, limit
from hapticvlm_studio.calibration.plate_flow import RUN_S, Floats, course_c

if TYPE_CHECKING:
    from hapticvlm.devices.plate.plate import Plate

TICK_S = 0.02
TTL_S = 0.25
# The current jumps with each step of the setpoint, and telemetry shows 20 samples of it a second.
# Were the steps in time with them, all would be of one age and the jump be taken for heat: this
# interval keeps out of step with 40, 50, 60 and 100 ms (computed: 1 ms of mean age, not 6).
STEP_S = 0.0777
Turn = Callable[[], float]  # lets a tick pass and returns the plate's time, s


def real_time() -> float:
    """Let a tick of the wall clock pass."""
    time.sleep(TICK_S)
    return time.monotonic()


def simulated_time() -> Turn:
    """Make ticks of a plate whose time only its caller advances."""
    ticks = itertools.count(1)
    return lambda: next(ticks) * TICK_S


def swing(plate: Plate, around_c: float, turn: Turn) -> Floats:
    """Drive one run within the plate's limits, then rest it; return the run for `estimate`.

    Raises DeviceError when the plate reports a fault or nothing.
    """
    rows: list[tuple[float, ...]] = []
    setpoint_c = NEUTRAL_C
    due_s = 0.0
    begun = before = now = turn()
    try:
        while (at_s := now - begun) < RUN_S:
            reading = plate.advance(now)
            measured = _measured(reading)
            if not rows or measured != rows[-1][1:]:  # readings come more seldom than ticks
                rows.append((at_s, *measured))
            if at_s >= due_s:
                wanted_c = course_c(around_c, at_s)
                setpoint_c = limit(wanted_c, setpoint_c, now - before, reading).setpoint_c
                before = now
                due_s = due_s + STEP_S
            plate.command(setpoint_c, TTL_S, now)
            now = turn()
    finally:
        plate.rest(now)
    return np.array(rows)


def _measured(reading: PlateReading) -> tuple[float, ...]:
    if reading.faults:
        raise DeviceError(faults.describe(reading.faults[0]))
    if reading.plate_c is None or reading.sink_c is None or reading.current_a is None:
        raise DeviceError("the plate reports no temperatures or current: `hapticvlm plate status`")
    return reading.plate_c, reading.current_a, reading.sink_c
