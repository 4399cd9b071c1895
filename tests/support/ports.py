"""Ports of this machine that a test names before its program listens there.

A port that the system gives for `bind(0)` is free only while it is held. Once it is let go, any
connection of a browser or a service may get it as its own end, since both are drawn from the same
range, and the program that was told to listen there finds it in use. So these ports lie below that
range, where nobody is given one unasked, and no two processes of a test run try the same ones
first.
"""

from __future__ import annotations

import itertools
import os
import socket
from collections.abc import Iterator

FIRST, END = 12_000, 32_000  # Linux gives from 32768 on, macOS and Windows from 49152 on


def _candidates() -> Iterator[int]:
    """Every port of the range, from a place that differs from process to process."""
    start = os.getpid() * 97
    return (FIRST + (start + step) % (END - FIRST) for step in itertools.count())


_next = _candidates()


def free_port() -> int:
    """Return a port of loopback that is free, and that this process has not returned before."""
    for _ in range(FIRST, END):
        port = next(_next)
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError:
            continue
        return port
    raise OSError(f"no free port between {FIRST} and {END}")
