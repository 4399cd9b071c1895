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
    is_cut: bool = False  # the serial line: nothing that is sent arrives, either way

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

    def until_driven(self, *, warm: bool = False, patience_s: float = 600.0) -> None:
        """Wait until the plate is driven away from neutral, colder or warmer."""
        until = time.monotonic() + patience_s
        while not (self.is_driven and is_away(self.board.plant.plate_c, warm=warm)):
            assert time.monotonic() < until, "the plate was never driven"
            time.sleep(0.01)


def is_away(plate_c: float, *, warm: bool) -> bool:
    """Whether a plate is clearly colder or warmer than neutral, 32 degC."""
    return plate_c > 35.0 if warm else plate_c < 28.0


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
            port.board.write(b"" if port.is_cut else data)
            behind = time.monotonic() - began - port.board.now
            port.board.advance(SLICE_S if port.hurries else max(0.0, min(behind, SLICE_S)))
            out = port.board.read()
        if port.hurries:  # real time goes on from where the chip's time has come to
            began += behind
        elif behind > MOST_BEHIND_S:
            began += behind - MOST_BEHIND_S
        with suppress(BlockingIOError):
            os.write(master, b"" if port.is_cut else out)
