"""The service's path from a touch to a setpoint, on a simulated board in simulated time.

`Rig` joins the unmodified `devices/plate/peltier.py`, over `sim://`, with the rendering that a
session uses: course, then limits. It is independent of the protocol.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import serial

from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.materials import MATERIALS
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat import contact as thermal
from hapticvlm.rendering.heat import limits as plate_limits
from hapticvlm.rendering.heat.contact import ThermalContact
from hapticvlm.rendering.heat.limits import Delay, PlateReading, Strongest
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

from .board import Board
from .protocol_sim import BOARDS
from .rawhost import SWITCHED_ON_S

LEASE_S = 0.25
_PACKAGE = __package__ or "firmware"


@dataclass(frozen=True)
class Moment:
    """One step at 50 Hz: the temperature from physics, the sent setpoint, the true plate."""

    now: float
    wanted_c: float
    setpoint_c: float
    limited_by: str | None
    plate_c: float
    skin_c: float
    reading: PlateReading


class Rig:
    """A scene's hand, the service's rendering and port, the board and the plant."""

    def __init__(self, board: Board) -> None:
        if _PACKAGE not in serial.protocol_handler_packages:
            serial.protocol_handler_packages.append(_PACKAGE)
        BOARDS["plate"] = board
        self.board = board
        self.course = ThermalTrajectory()
        self.peltier = Peltier("sim://plate", clock=lambda: board.now)
        self.peltier.connect()  # which resets the board, so its cut-out opens
        board.press_start()
        board.advance(SWITCHED_ON_S)
        self._setpoint_c = NEUTRAL_C
        self._strongest = Strongest()
        self._delay = Delay()
        self._last = board.now

    def live(self, seconds: float) -> list[Moment]:
        """Render for `seconds`, one setpoint per turn of the port (20 ms)."""
        until = self.board.now + seconds
        moments = []
        while self.board.now < until:
            moments.append(self._turn())
        return moments

    def close(self) -> None:
        """Switch the plate off."""
        self.peltier.close()
        BOARDS.pop("plate", None)

    def _turn(self) -> Moment:
        self.peltier.poll()
        now = self.board.now
        reading = self.peltier.advance(now)
        wanted_c = self.course.target_c(now)
        elapsed_s, strength = now - self._last, self.course.strength
        self._strongest = self._strongest.towards(wanted_c, strength, elapsed_s, reading)
        is_felt = self.course.begun_at is not None
        self._delay = self._delay.after(wanted_c, elapsed_s, reading) if is_felt else Delay()
        wanted_c -= plate_limits.CATCH_UP * self._delay.behind_c
        limited = plate_limits.limit(
            wanted_c,
            self._setpoint_c,
            elapsed_s,
            reading,
            strength=strength,
            strongest=self._strongest,
        )
        self._setpoint_c, self._last = limited.setpoint_c, now
        self.peltier.command(limited.setpoint_c, LEASE_S, now)
        plant = self.board.plant
        return Moment(
            now,
            wanted_c,
            limited.setpoint_c,
            limited.limited_by,
            plant.plate_c,
            plant.skin_c,
            reading,
        )


def contact(material: str, ambient_c: float) -> ThermalContact:
    """Return the contact with a thick object of `material` that has the room's temperature."""
    return thermal.thermal_contact(MATERIALS[material].thermal, ambient_c)


def rms(moments: list[Moment], error: Callable[[Moment], float]) -> float:
    """Root mean square of `error` over `moments`."""
    return math.sqrt(sum(error(moment) ** 2 for moment in moments) / len(moments))
