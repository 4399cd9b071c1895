"""`hapticvlm plate simulate`: a simulated plate on a TCP port, to practise on before there is one.

Other commands open the port by its address, `socket://127.0.0.1:8795`, as they open a serial port,
and speak the protocol of the real board. A fault is latched by its name, typed here. The firmware's
own decisions are not simulated: the compiled firmware decides them, in tests/firmware.
"""

from __future__ import annotations

import argparse
import socket
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import number_within
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

PORT = 8795
LOOPBACK = "127.0.0.1"
TURN_S = 0.02  # between two looks at the clock, as the board's control loop
AT_ONCE_BYTES = 4096


def add(verbs: Commands) -> None:
    """Declare the command below `plate`."""
    simulate = verbs.add_parser(
        "simulate",
        help="run a simulated plate on a TCP port, to practise status, faults and clearing",
        description="Run a simulated plate on a TCP port of this machine until Ctrl-C. Other "
        "commands use its address as a serial port. The name of a fault, typed here, latches it.",
        examples=(
            "hapticvlm plate simulate",
            "hapticvlm plate simulate --fault runaway  # begin with a latched fault",
        ),
    )
    simulate.add_argument(
        "--tcp-port",
        type=number_within(0, 65535),
        default=PORT,
        metavar="PORT",
        help="TCP port to listen on, 0 for any free one (%(default)s)",
    )
    simulate.add_argument(
        "--fault", action="append", default=[], metavar="NAME", help="begin with this fault latched"
    )
    simulate.set_defaults(run=_simulate)


class PractisePlate(SimulatedPlate):
    """A simulated plate whose faults are latched on request, as a maker's mistake would."""

    def latch(self, name: str) -> None:
        """Latch a fault of the firmware and open the bridge. Raises DeviceError for another."""
        from hapticvlm.devices import faults

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


def _simulate(options: argparse.Namespace) -> int:
    plate = PractisePlate()
    for name in options.fault:
        plate.latch(name)
    with socket.create_server((LOOPBACK, int(options.tcp_port))) as listener:
        address = f"socket://{LOOPBACK}:{listener.getsockname()[1]}"
        print(
            f"simulated plate on {address}; in another terminal:\n"
            f"  hapticvlm plate status --port {address}\n"
            f"  hapticvlm plate clear --port {address}\n"
            f"  hapticvlm plate flash --dry-run --port {address}\n"
            f"  hapticvlm serve --peltier {address}\n"
            "Type the name of a fault, such as plate_a_open, to latch it. Ctrl-C ends.",
            flush=True,
        )
        typed: list[str] = []
        threading.Thread(target=_read, args=(typed,), daemon=True).start()
        serve(listener, plate, lambda: [typed.pop(0) for _ in range(len(typed))])
    return 0


def _read(typed: list[str]) -> None:
    """Collect the faults that a person types; a wrong name is refused with the right ones."""
    for line in sys.stdin or ():
        name = line.strip()
        try:
            PractisePlate().latch(name)
        except DeviceError as error:
            print(error, flush=True)
        else:
            typed.append(name)
            print(f"{name} latched; `hapticvlm plate clear {name}` clears it", flush=True)
