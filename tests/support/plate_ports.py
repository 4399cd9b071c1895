"""A clock that reads advance, and ports that misbehave, for plates driven in lock-step."""

from __future__ import annotations

import random
from collections.abc import Callable

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import READ_S
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard, SimulatedPort

TURN_S = 0.02


class Clock:
    """Simulated seconds; waiting makes them pass."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += seconds


class Cable:
    """The line to one board, which can be cut, flooded or stalled; opening resets the board."""

    def __init__(self, make: Callable[[], SimulatedBoard] = SimulatedBoard) -> None:
        self.clock = Clock()
        self.make = make
        self.board = make()
        self.is_cut = False
        self.is_mute = False
        self.noise = b""
        self.lost_share = 0.0  # of the bytes, both ways
        self.opened = 0
        self.sent: list[plate_protocol.Message] = []

    def open(self, _: str) -> CablePort:
        if self.is_cut:
            raise DeviceError("can't be opened: No such file or directory")
        self.opened += 1
        self.board = self.make()
        return CablePort(self)

    def plate(self) -> Peltier:
        """A connected plate at the end of this cable."""
        plate = Peltier("cable", open_port=self.open, clock=self.clock)
        plate.connect()
        return plate


class CablePort(SimulatedPort):
    """What pyserial gives; raises as pyserial does once the cable is cut."""

    def __init__(self, cable: Cable) -> None:
        super().__init__(cable.board, cable.clock, cable.clock.wait)
        self._cable = cable
        self._deframer = Deframer()
        self._chance = random.Random(1)

    def longest_read_s(self) -> float:
        is_off = self._board.plate.state is plate_protocol.State.OFF
        return super().longest_read_s() if is_off else READ_S

    def read(self, size: int) -> bytes:
        if self._cable.is_cut:
            raise OSError("device reports readiness to read but returned no data")
        found = self._through(super().read(size))
        return self._cable.noise + (b"" if self._cable.is_mute else found)

    def write(self, data: bytes) -> int:
        if self._cable.is_cut:
            raise OSError("write failed")
        self._cable.sent += [plate_protocol.decode(frame) for frame in self._deframer.feed(data)]
        return super().write(self._through(data))

    def _through(self, data: bytes) -> bytes:
        share = self._cable.lost_share
        return bytes(byte for byte in data if self._chance.random() >= share) if share else data
