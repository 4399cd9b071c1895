"""Reports the state of the service to systemd, as sd_notify(3) does, without its library."""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress

READY = "READY=1"
STOPPING = "STOPPING=1"


def notify(state: str) -> None:
    """Send a state to the service manager that started this program; without one do nothing.

    Never blocks and never raises: a service that cannot report its state still runs.
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if sys.platform == "win32" or not address:
        return
    if address.startswith("@"):  # an abstract address of Linux, whose first byte is 0
        address = f"\0{address[1:]}"
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.setblocking(False)
        sender.sendto(state.encode(), address)
