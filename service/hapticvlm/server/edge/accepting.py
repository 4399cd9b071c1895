"""Takes connections from the kernel one at a time, and no more of them than one may cost.

asyncio's own server takes up to a hundred in one turn of its loop. A touch waited 57 ms behind
them. Here one is taken a turn, at a rate for each address: what exceeds it from another machine is
closed at once. What exceeds it from this machine waits in the kernel, since nobody can tell a
hostile program from `hapticvlm stop` before it has spoken.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import time
from collections import Counter, OrderedDict
from collections.abc import Callable
from typing import Any

from hapticvlm.server.budgets import CONNECTS, TokenBucket
from hapticvlm.server.web.http import is_loopback

BACKLOG = 128  # wait in the kernel
ADDRESSES = 256  # whose budgets are remembered
PAUSE_S = 0.01
NO_FILES_S = 0.5  # until another try when the system has no descriptor left

logger = logging.getLogger(__name__)


class ConnectBudgets:
    """How many connections each address may still make. All of this machine are one address."""

    def __init__(self) -> None:
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()

    def spend(self, address: str, now: float) -> bool:
        """Count a connection; false: it is one too many just now."""
        name = "" if is_loopback(address) else address
        bucket = self._buckets.pop(name, None) or TokenBucket(CONNECTS, now)
        self._buckets[name] = bucket
        if len(self._buckets) > ADDRESSES:
            self._buckets.popitem(last=False)
        return bucket.spend(1, now)


async def bind(host: str, port: int) -> list[socket.socket]:
    """Return sockets that listen at every address of a host. Raises OSError."""
    loop = asyncio.get_running_loop()
    found = await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    listening: list[socket.socket] = []
    try:
        for family, address in dict.fromkeys((row[0], row[4]) for row in found):
            listening.append(_listening(family, address))
    except OSError:
        for each in listening:
            each.close()
        raise
    return listening


def _listening(family: int, address: Any) -> socket.socket:  # noqa: ANN401 - differs by family
    # The protocol is stated, though there is only one: asyncio sends small answers at once
    # (TCP_NODELAY) on sockets that state it, and lets the kernel gather those of others.
    made = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        made.setblocking(False)
        if os.name == "posix":
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        made.bind(address)
        made.listen(BACKLOG)
    except OSError:
        made.close()
        raise
    return made


async def accept(
    listening: socket.socket,
    admit: Callable[[socket.socket], None],
    has_room: Callable[[], bool],
    counts: Counter[str],
) -> None:
    """Admit what connects, until cancelled."""
    loop = asyncio.get_running_loop()
    budgets = ConnectBudgets()
    while True:
        try:
            taken, address = await loop.sock_accept(listening)
        except OSError as error:
            logger.warning("no connection was taken: %s", error)
            await asyncio.sleep(NO_FILES_S)
            continue
        if is_loopback(address[0]):
            while not (has_room() and budgets.spend(address[0], time.monotonic())):  # noqa: ASYNC110
                await asyncio.sleep(PAUSE_S)
            admit(taken)
        elif budgets.spend(address[0], time.monotonic()):
            admit(taken)
        else:
            counts["refused: too many connects"] += 1
            taken.close()
        await asyncio.sleep(0)
