"""A plate kept on its trajectory while a person is asked: the hands of `calibrate thermal`."""

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


class Bench:
    """Renews one plate's command at 50 Hz from its own thread; neutral until it gets another.

    The plate goes ahead of the skin by `plate_resistance` (m2 K/W), as in the service.
    """

    def __init__(self, plate: Plate, plate_resistance: float = PLATE_RESISTANCE) -> None:
        self._plate = plate
        self._lock = threading.Lock()
        self._resting = ThermalTrajectory(plate_resistance=plate_resistance)
        self._trajectory = self._resting
        self._contact: ThermalContact | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)
        self._thread.start()

    def prepare(self, contact: ThermalContact) -> None:
        """Wait for a touch of this, as an approach does."""
        with self._lock:
            self._contact = contact
            self._trajectory = self._resting.approach(contact, time.monotonic())

    def touch(self) -> None:
        """Act as if the object just prepared were touched now."""
        with self._lock:
            self._trajectory = self._trajectory.touch(self._contact, "plate", time.monotonic())

    def release(self) -> None:
        """Return to neutral and forget the touch."""
        with self._lock:
            self._trajectory = self._resting

    def close(self) -> None:
        """Rest the plate and end the thread."""
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
                wanted_c = self._trajectory.wanted_c(now)
            limited = limit(wanted_c, setpoint_c, now - before, reading)
            setpoint_c = limited.setpoint_c
            before = now
            self._plate.command(setpoint_c, TTL_S, now)
