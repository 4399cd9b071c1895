"""`hapticvlm plate simulate`: a simulated plate on a TCP port, to practise on beforehand."""

from __future__ import annotations

import argparse
import socket
import sys
import threading
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import number_within
from hapticvlm.commands.service_address import port_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

PORT = 8795
LOOPBACK = "127.0.0.1"


def add(verbs: Commands) -> None:
    """Declare the command below `plate`."""
    simulate = verbs.add_parser(
        "simulate",
        help="run a simulated plate on a TCP port, to practise status, faults and clearing",
        description="Run a simulated plate on a TCP port of this machine until Ctrl-C. Other "
        "commands use its address as a serial port. The name of a fault, typed here, latches it.",
        examples=("hapticvlm plate simulate",),
    )
    simulate.add_argument(
        "--port",
        type=number_within(0, 65535),
        default=PORT,
        metavar="PORT",
        help="TCP port to listen on, 0 for any free one (%(default)s)",
    )
    simulate.set_defaults(run=_simulate)


def _simulate(options: argparse.Namespace) -> int:
    from hapticvlm.devices.simulated.practise_plate import PractisePlate, serve

    port = int(options.port)
    with port_errors(port), socket.create_server((LOOPBACK, port)) as listener:
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
        threading.Thread(target=_read, args=(typed, address), daemon=True).start()
        serve(listener, PractisePlate(), lambda: [typed.pop(0) for _ in range(len(typed))])
    return 0


def _read(typed: list[str], address: str) -> None:
    """Collect the faults that a person types; a wrong name is refused with the right ones."""
    from hapticvlm.devices.errors import DeviceError
    from hapticvlm.devices.simulated.practise_plate import PractisePlate

    for line in sys.stdin or ():
        name = line.strip()
        try:
            PractisePlate().latch(name)
        except DeviceError as error:
            print(error, flush=True)
        else:
            typed.append(name)
            clearing = f"hapticvlm plate clear {name} --port {address}"
            print(f"{name} latched; `{clearing}` clears it", flush=True)
