"""The compiled firmware on a simulated chip behind a pseudo-terminal, in real time."""

from __future__ import annotations

import os
import pty
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from firmware.board import Board

SLICE_S = 0.005
MOST_BEHIND_S = 0.1  # a machine too busy for real time lets the chip's time pass more slowly


@dataclass
class FirmwarePort:
    """A board that lives by itself; hold `lock` to touch it."""

    board: Board
    path: str
    lock: threading.Lock = field(default_factory=threading.Lock)
    ending: threading.Event = field(default_factory=threading.Event)
    hurries: bool = False  # the chip's time passes as fast as it can: for when nobody answers it

    @property
    def now(self) -> float:
        """The chip's time, s."""
        with self.lock:
            return self.board.now

    @property
    def is_driven(self) -> bool:
        """Whether the bridge has driven within the last tenth of a second of the chip's time."""
        with self.lock:
            return self.board.now - self.board.last_driven_at < 0.1

    def driven_for(self, since: float, most_s: float) -> float:
        """Wait until the bridge is off for half a second; return how long it still was driven."""
        while self.now - since < most_s:
            with self.lock:
                last, now = self.board.last_driven_at, self.board.now
            if now - max(last, since) > 0.5:
                return max(0.0, last - since)
            time.sleep(0.01)
        return float("inf")

    def until_driven(self, patience_s: float = 60.0) -> None:
        """Wait until the plate is driven away from neutral."""
        until = time.monotonic() + patience_s
        while not (self.is_driven and self.board.plant.plate_c < 28.0):
            assert time.monotonic() < until, "the plate was never driven"
            time.sleep(0.01)


@contextmanager
def firmware_on_a_terminal(board: Board) -> Iterator[FirmwarePort]:
    """Run the board behind a terminal for as long as the context lasts."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    port = FirmwarePort(board, os.ttyname(slave))
    thread = threading.Thread(target=_live, args=(port, master), daemon=True)
    thread.start()
    try:
        yield port
    finally:
        port.ending.set()
        thread.join(10.0)
        os.close(master)
        os.close(slave)


def _live(port: FirmwarePort, master: int) -> None:
    began, behind = time.monotonic() - port.board.now, 0.0
    while not port.ending.wait(0.0 if port.hurries else SLICE_S / 2):
        data = b""
        with suppress(BlockingIOError):
            data = os.read(master, 4096)
        with port.lock:
            port.board.write(data)
            behind = time.monotonic() - began - port.board.now
            port.board.advance(SLICE_S if port.hurries else max(0.0, min(behind, SLICE_S)))
            out = port.board.read()
        if behind > MOST_BEHIND_S:
            began += behind - MOST_BEHIND_S
        with suppress(BlockingIOError):
            os.write(master, out)
