"""A simulated plate behind a TCP port, whose faults a person latches, to practise on.

Other commands open the port by its address, `socket://127.0.0.1:8795`, as they open a serial port,
and speak the protocol of the real board. The firmware's own decisions are not simulated: the
compiled firmware decides them, in tests/firmware.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

from hapticvlm.devices import faults
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard

TURN_S = 0.02  # between two looks at the clock, as the board's control loop
AT_ONCE_BYTES = 4096


class PractisePlate(SimulatedPlate):
    """A simulated plate whose faults are latched on request, as a maker's mistake would."""

    def latch(self, name: str) -> None:
        """Latch a fault of the firmware and open the bridge. Raises DeviceError for another."""
        known = [fault.name for fault in faults.FIRMWARE.values()]
        if name not in known:
            raise DeviceError(f"{name}: no fault of the firmware; they are {', '.join(known)}")
        if name not in self._faults:
            self._faults = (*self._faults, name)
        self.close()


def serve(
    listener: socket.socket, plate: PractisePlate, wanted: Callable[[], list[str]] = list
) -> None:
    """Answer one host after the other; `wanted` returns the faults to latch since it was asked.

    A host that leaves makes the plate rest when its setpoint's time to live ends, as on a real
    line. Ends with the listener, by OSError.
    """
    board = SimulatedBoard(plate)
    while True:
        host, _ = listener.accept()
        with host:
            host.settimeout(TURN_S)
            _answer(host, board, plate, wanted)


def _answer(
    host: socket.socket,
    board: SimulatedBoard,
    plate: PractisePlate,
    wanted: Callable[[], list[str]],
) -> None:
    """Exchange bytes with one host until it leaves."""
    while True:
        for name in wanted():
            plate.latch(name)
        try:
            data = host.recv(AT_ONCE_BYTES)
            if not data:
                return
        except TimeoutError:
            data = b""
        except OSError:
            return
        try:
            host.sendall(board.exchange(data, time.monotonic()))
        except OSError:
            return
