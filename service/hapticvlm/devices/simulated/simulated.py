"""Simulates a Peltier plate without hardware: controller and guards on the plant model.

The guards are those of the firmware's that a simulated plate can need: the lease, the limits of the
setpoint, and trips that latch. A latched fault opens the bridge and stays until it is cleared by
name, also when its cause is gone.
"""

from __future__ import annotations

import math

from hapticvlm.devices.plate.protocol import State
from hapticvlm.devices.plate.requests import CHANGE_INTERVAL_S
from hapticvlm.devices.plate.session import REST_S
from hapticvlm.devices.simulated.plant import AMBIENT_C, SINK_K_PER_W, Bead, Module, Plant
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C
from hapticvlm.rendering.heat import limits as plate_limits
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.rendering.heat.limits import PlateReading, sink_share

HEAT_LIMIT_A, COOL_LIMIT_A = 1.8, 3.0  # what the limiter's resistors let pass (docs/physics.md 3.3)
_GAIN_P, _GAIN_I = 1.0, 1.2  # A/K and A/(K s) (physics.md 2.4)
_FORWARD_A_S_K = 0.16  # for a light face of 0.6 J/K, as an ampere moves 3.86 W
_FALL_C = 0.25  # only a real fall, not the small steps of a host
_FALL_S = 0.06  # until a fall that stays this close has ended
_FACE_FILTER_S = 0.06  # over which the slope of the reading is averaged
_MOST_AHEAD_C = 10.0  # of the estimated face before its reading
_LEAD_C = 0.4  # by which the target may lead a plate that is at its current limit
TICK_S = 0.02
_ROUNDING_S = 1e-9  # sums of equal steps differ by it
_LONGEST_GAP_S = 5.0  # of a longer gap only so much is simulated
_ARRIVED_C = 0.3  # from neutral: the return is over
_LONGEST_RETURN_S = 10.0
_MODULE = Module()


class SimulatedPlate:
    """A plate on the plant model, with lease, limits and latching trips; see `Plate`.

    `stuck_sensor_c` replaces what the plate's sensor reads, to simulate a broken one. The sensor
    lags behind the face by `bead_lag_s`; `lag_s` is the lag that the controller was told, the true
    one at first.

    A board gets a changed setpoint each CHANGE_INTERVAL_S at most, however often the service
    commands, and its feed-forward acts on steps of that size. So this plate takes the newest
    command no more often.
    """

    simulated = True
    name = "simulated plate"

    def __init__(
        self,
        ambient_c: float = AMBIENT_C,
        stuck_sensor_c: float | None = None,
        palm_resistance: float = PLATE_RESISTANCE,
        *,
        bead_lag_s: float = 0.0,
        module: Module = _MODULE,
    ) -> None:
        self._plant = Plant(ambient_c, SINK_K_PER_W, palm_resistance, module=module)
        self._bead = Bead(self._plant.plate_c, bead_lag_s)
        self.lag_s = bead_lag_s
        self._sensed_before_c: float | None = None
        self._sensed_slope_c_s = 0.0
        self._stuck_sensor_c = stuck_sensor_c
        self._now: float | None = None
        self._newest_c = self._commanded_c = NEUTRAL_C
        self._unchanged_s = math.inf  # since another setpoint was taken
        self._lease_s = 0.0
        self._returning_s: float | None = None  # since the return to neutral began
        self._on = False
        self._target_c = NEUTRAL_C
        self._current_a = 0.0
        self._integral_a = 0.0
        self._falling_s = 0.0  # for which the target still counts as falling fast
        self._saturated = 0  # 1 wants more heat than the limit, -1 more cold
        self._dose_cem43 = 0.0
        self._heated_s = 0.0
        self._rested_s = 0.0
        self._faults: tuple[str, ...] = ()

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` (degC), limited, for `ttl_s`; no effect while a fault is latched."""
        self.advance(now)
        if self._faults or not 0.0 < ttl_s < math.inf:
            return
        if not self._on:
            self._target_c = plate_limits.within_range(self._face_c()).setpoint_c
        self._newest_c = plate_limits.within_range(setpoint_c).setpoint_c
        self._take_newest()
        self._lease_s = ttl_s
        self._returning_s = None
        self._on = True

    def rest(self, now: float) -> None:
        """Return to neutral, then open the bridge."""
        self.advance(now)
        self._lapse()

    def off(self, now: float) -> None:
        """Open the bridge at once."""
        self.advance(now)
        self.close()

    def advance(self, now: float) -> PlateReading:
        """Simulate up to `now`; a clock that jumps back ends the lease, a long gap is cut short."""
        elapsed_s = 0.0 if self._now is None else now - self._now
        if math.isfinite(now):
            self._now = now
        if not -_ROUNDING_S <= elapsed_s <= _LONGEST_GAP_S:
            self._lapse()
            elapsed_s = _LONGEST_GAP_S if elapsed_s > 0.0 else 0.0
        ticks = math.ceil(elapsed_s / TICK_S - 1e-6)
        for _ in range(ticks):
            self._tick(round(elapsed_s / ticks, 9))  # rounded, so that equal steps share a solution
        return self._reading()

    @property
    def state(self) -> State:
        """Activity of the plate."""
        if self._faults:
            return State.FAULTED
        if not self._on:
            return State.OFF
        return State.HOLDING if self._returning_s is None else State.RETURNING

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the latched faults, in the order in which they occurred."""
        return self._faults

    @property
    def current_a(self) -> float:
        """Current through the module in A, positive when it heats."""
        return self._current_a

    @property
    def skin_c(self) -> float:
        """Temperature of the simulated palm's surface, degC; a real plate does not know it."""
        return self._plant.skin_c

    @property
    def counts(self) -> dict[str, int]:
        """Empty: a simulated plate has no line that could lose anything."""
        return {}

    def touch(self, palm_resistance: float) -> None:
        """Lay the simulated palm on the face, with this resistance in m2 K/W; inf lifts it."""
        self._plant.touch(palm_resistance)

    def clear(self, fault: str) -> bool:
        """Unlatch one fault and return True, or False if its cause is still there.

        The plate stays off until the next command.
        """
        if fault in self._causes():
            return False
        self._faults = tuple(name for name in self._faults if name != fault)
        return True

    def close(self) -> None:
        """Open the bridge; only a new command closes it again."""
        self._lease_s = 0.0
        self._open()

    def _tick(self, dt_s: float) -> None:
        self._lease_s -= dt_s
        self._unchanged_s += dt_s
        if self._lease_s < 0.0:
            self._lapse()
        self._take_newest()
        self._follow_slope(dt_s)
        self._trip()
        self._finish_return(dt_s)
        if self._on:
            limited = plate_limits.limit(self._commanded_c, self._target_c, dt_s, self._reading())
            is_falling = self._commanded_c - self._target_c < -_FALL_C
            self._falling_s = _FALL_S if is_falling else max(self._falling_s - dt_s, 0.0)
            slope_c_s = (limited.setpoint_c - self._target_c) / dt_s
            # While the current is at its limit the plate cannot keep up, and the target would run
            # far ahead of it. When the target turned back, the plate would continue in the old
            # direction until the two met: a hand that released something cold would be cooled
            # further. So the target waits for the plate.
            if not self._must_wait(limited.setpoint_c):
                self._target_c = limited.setpoint_c
            self._control(slope_c_s, dt_s)
        self._plant.step(self._current_a, dt_s)
        self._bead.feel(self._plant.plate_c, dt_s)
        self._account(dt_s)

    def _take_newest(self) -> None:
        """Take the newest command, unless another was taken less than CHANGE_INTERVAL_S ago."""
        is_due = self._unchanged_s > CHANGE_INTERVAL_S - TICK_S / 2.0
        if is_due and self._newest_c != self._commanded_c:
            self._commanded_c, self._unchanged_s = self._newest_c, 0.0

    def _forget_command(self) -> None:
        self._newest_c = self._commanded_c = NEUTRAL_C
        self._unchanged_s = math.inf  # a board gets the first setpoint of a lease at once

    def _lapse(self) -> None:
        self._forget_command()
        self._lease_s = 0.0
        if self._on and self._returning_s is None:
            self._returning_s = 0.0

    def _finish_return(self, dt_s: float) -> None:
        if self._returning_s is None:
            return
        self._returning_s += dt_s
        arrived = abs(self._sensed_c() - NEUTRAL_C) < _ARRIVED_C
        if arrived or self._returning_s > _LONGEST_RETURN_S:
            self._open()

    def _trip(self) -> None:
        self._faults += tuple(name for name in self._causes() if name not in self._faults)
        if self._faults:
            self._open()

    def _causes(self) -> tuple[str, ...]:
        readings_c = self._sensed_c(), self._face_c()
        conditions = (
            ("over_temperature", max(readings_c) >= plate_limits.PLATE_TRIP_HIGH_C),
            ("under_temperature", min(readings_c) <= plate_limits.PLATE_TRIP_LOW_C),
            ("sink_hot", self._plant.sink_c >= plate_limits.SINK_TRIP_C),
        )
        return tuple(name for name, is_met in conditions if is_met)

    def _open(self) -> None:
        self._on = False
        self._returning_s = None
        self._forget_command()
        self._current_a = self._integral_a = 0.0
        self._saturated = 0
        self._target_c = NEUTRAL_C

    def _must_wait(self, target_c: float) -> bool:
        """Return whether this target would run too far ahead of a plate at its current limit."""
        side = self._saturated
        ahead_c = side * (self._target_c - self._face_c())
        return side * (target_c - self._target_c) > 0.0 and ahead_c > _LEAD_C

    def _control(self, slope_c_s: float, dt_s: float) -> None:
        """Set the current by a PI controller with feed-forward and limits.

        The feed-forward is the current that a face needs for its heat capacity alone when its
        target cools by `slope_c_s`. The hotter the sink, the lower the limit of cooling, because on
        a hot sink more current would warm the plate (physics.md 2.3).
        """
        error_c = self._target_c - self._face_c()
        forward_a = _FORWARD_A_S_K * min(slope_c_s, 0.0) if self._falling_s > 0.0 else 0.0
        unlimited_a = _GAIN_P * error_c + self._integral_a + forward_a
        most_cool_a = COOL_LIMIT_A * (1.0 - sink_share(self._plant.sink_c))
        self._current_a = min(max(unlimited_a, -most_cool_a), HEAT_LIMIT_A)
        self._saturated = (unlimited_a > self._current_a) - (unlimited_a < self._current_a)
        # The integral stops while the current is at its limit and would push further in the same
        # direction (anti-windup); otherwise the plate would overshoot by what it had stored.
        if not self._saturated or (error_c > 0.0) != (unlimited_a > 0.0):
            self._integral_a += _GAIN_I * error_c * dt_s

    def _follow_slope(self, dt_s: float) -> None:
        sensed_c = self._sensed_c()
        if self._sensed_before_c is not None and dt_s > 0.0:
            slope_c_s = (sensed_c - self._sensed_before_c) / dt_s
            share = min(dt_s / _FACE_FILTER_S, 1.0)
            self._sensed_slope_c_s += share * (slope_c_s - self._sensed_slope_c_s)
        self._sensed_before_c = sensed_c

    def _face_c(self) -> float:
        """Return the estimated face, degC: a bead lags, so the face is ahead by lag times slope.

        The slope itself is late by its filter, so the estimate leads by that time too.
        """
        ahead_c = (self.lag_s + _FACE_FILTER_S) * self._sensed_slope_c_s
        return self._sensed_c() + min(max(ahead_c, -_MOST_AHEAD_C), _MOST_AHEAD_C)

    def _account(self, dt_s: float) -> None:
        skin_c = self._plant.skin_c
        # CEM43 counts minutes at 43 degC: each degree above 43 halves the time to the same damage,
        # each degree below multiplies it by 4 (physics.md 3.1).
        halving = 0.5 if skin_c >= 43.0 else 0.25
        self._dose_cem43 += dt_s / 60.0 * halving ** (43.0 - skin_c)
        if self._on and self._target_c > NEUTRAL_C + THERMAL_FLOOR_C:
            self._heated_s += dt_s
            self._rested_s = 0.0
            return
        self._rested_s += dt_s
        if self._rested_s >= REST_S:
            self._dose_cem43 = self._heated_s = 0.0

    def _sensed_c(self) -> float:
        return self._bead.c if self._stuck_sensor_c is None else self._stuck_sensor_c

    def _reading(self) -> PlateReading:
        limit_a = HEAT_LIMIT_A if self._current_a > 0.0 else COOL_LIMIT_A
        return PlateReading(
            plate_c=self._sensed_c(),
            sink_c=self._plant.sink_c,
            setpoint_c=self._target_c,
            duty=self._current_a / limit_a,
            current_limited=self._saturated != 0,
            dose_cem43=self._dose_cem43,
            heated_s=self._heated_s,
            faults=self._faults,
            current_a=self._current_a,
            lag_s=self.lag_s,
        )
