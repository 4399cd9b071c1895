"""Keeps a plate on its trajectory while a person is asked questions, for `calibrate thermal`.

The main thread waits for input most of the time, and a plate whose command is not renewed switches
off after TTL_S. So a thread of its own renews it; the main thread only sets what is rendered.
"""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE, ThermalContact
from hapticvlm.rendering.heat.limits import limit
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

if TYPE_CHECKING:
    from hapticvlm.devices.plate.plate import Plate

TICK_S = 0.02
TTL_S = 0.25


class PlateDriver:
    """Renews one plate's command at 50 Hz from its own thread; neutral until a touch is prepared.

    The plate leads the skin across `plate_resistance` (m2 K/W), as in the service. Only the thread
    touches the plate until `close`; the lock guards the trajectory, which both threads exchange.
    """

    def __init__(self, plate: Plate, plate_resistance: float = PLATE_RESISTANCE) -> None:
        self._plate = plate
        self._lock = threading.Lock()
        self._neutral = ThermalTrajectory(plate_resistance=plate_resistance)
        self._trajectory = self._neutral
        self._contact: ThermalContact | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="plate driver", daemon=True)
        self._thread.start()

    def prepare(self, contact: ThermalContact) -> None:
        """Bring the plate to where a touch of this object begins, as an approach does."""
        with self._lock:
            self._contact = contact
            self._trajectory = self._neutral.approach(contact, time.monotonic())

    def touch(self) -> None:
        """Render a touch of the prepared object, from now on."""
        with self._lock:
            self._trajectory = self._trajectory.touch(self._contact, "plate", time.monotonic())

    def release(self) -> None:
        """End the touch and return to neutral."""
        with self._lock:
            self._trajectory = self._neutral

    def close(self) -> None:
        """End the thread, then rest the plate."""
        self._stopping.set()
        self._thread.join()
        self._plate.rest(time.monotonic())

    def _run(self) -> None:
        setpoint_c = NEUTRAL_C
        before = time.monotonic()
        while not self._stopping.wait(TICK_S):
            now = time.monotonic()
            reading = self._plate.advance(now)
            with self._lock:
                wanted_c = self._trajectory.target_c(now)
            limited = limit(wanted_c, setpoint_c, now - before, reading)
            setpoint_c = limited.setpoint_c
            before = now
            self._plate.command(setpoint_c, TTL_S, now)
