"""Moves a plate through the temperatures of `calibrate plate` and records what it reports.

The estimate itself is pure and lies in `plate_flow`; this module is the part that needs a plate and
a clock. Time comes from the caller, so a simulated plate runs through 72 s in a moment.
"""

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
from hapticvlm_studio.calibration.plate_flow import RUN_S, Floats, trajectory_c

if TYPE_CHECKING:
    from hapticvlm.devices.plate.plate import Plate

TICK_S = 0.02
TTL_S = 0.25
# The current jumps with each step of the setpoint, and telemetry samples it 20 times a second. If
# steps and samples were in phase, every sample would see the jump at the same age, and the jump
# would be taken for heat that flows into the palm. This interval drifts against 40, 50, 60 and
# 100 ms, so the samples fall at all ages alike (computed: their mean age is off by 1 ms, not 6).
STEP_S = 0.0777
NextTick = Callable[[], float]  # waits for the next tick and returns the plate's time, s


def real_time() -> float:
    """Wait for the next tick of the wall clock and return its time, s."""
    time.sleep(TICK_S)
    return time.monotonic()


def simulated_time() -> NextTick:
    """Return a clock for a plate whose time only its caller advances."""
    ticks = itertools.count(1)
    return lambda: next(ticks) * TICK_S


def swing(plate: Plate, around_c: float, next_tick: NextTick) -> Floats:
    """Drive one run around `around_c` degC, rest the plate, and return the run.

    The run is (n, 4) float64, as `plate_flow.estimate` takes it: time in s since it began, plate
    in degC, current in A, sink in degC. Setpoints stay within the limits of the service. Raises
    DeviceError when the plate reports a fault, or no temperatures or current.
    """
    rows: list[tuple[float, ...]] = []
    setpoint_c = NEUTRAL_C
    due_s = 0.0
    started_at = limited_at = now = next_tick()
    try:
        while (at_s := now - started_at) < RUN_S:
            reading = plate.advance(now)
            measured = _measured(reading)
            # Telemetry arrives less often than ticks. A reading that was seen before is no new
            # sample; counting it again would make the fit look more certain than it is.
            if not rows or measured != rows[-1][1:]:
                rows.append((at_s, *measured))
            if at_s >= due_s:
                wanted_c = trajectory_c(around_c, at_s)
                setpoint_c = limit(wanted_c, setpoint_c, now - limited_at, reading).setpoint_c
                limited_at = now
                due_s = due_s + STEP_S
            plate.command(setpoint_c, TTL_S, now)
            now = next_tick()
    finally:
        # Also after Ctrl-C or a fault: the plate returns to neutral and switches off. If this
        # command is lost, the firmware acts by itself once TTL_S has passed.
        plate.rest(now)
    return np.array(rows)


def _measured(reading: PlateReading) -> tuple[float, ...]:
    if reading.faults:
        raise DeviceError(faults.describe(reading.faults[0]))
    if reading.plate_c is None or reading.sink_c is None or reading.current_a is None:
        raise DeviceError(
            "the plate reports no temperatures or no current: see `hapticvlm plate status`"
        )
    return reading.plate_c, reading.current_a, reading.sink_c
