"""A simulated board at the end of a pseudo-terminal, in a process of its own, with a diary.

`python -m hapticvlm_lab.bench.reliability.board` prints the terminal's path, then a JSON line for
each OFF that arrives and for each new state of the plate, with its time of the monotonic clock.

A pseudo-terminal hands its bytes over through a kernel thread of normal priority. On a busy machine
that thread waits, whatever priority both ends have: 12 ms at p99 beside a load of 11, where a
socket takes 0.2.
"""

from __future__ import annotations

import json
import os
import pty
import select
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard
from hapticvlm.processes.priority import request_priority
from hapticvlm_lab.bench.rigs import Process, first_line, helper

TURN_S = 0.005  # longest step of the simulated plate
READ_BYTES = 4096
OFF = "OFF on the line"


@dataclass(slots=True)
class PtyBoard:
    """Our end: the board's port, and its events as (monotonic s, event)."""

    port: str
    pid: int = 0
    events: list[tuple[float, str]] = field(default_factory=list)

    @property
    def state(self) -> str:
        """The newest state of the plate."""
        for _, what in reversed(self.events):
            if what != OFF:
                return what
        return "OFF"

    def first(self, what: str, since: float, until: float) -> float | None:
        """Return the first time of this event in between, if it happened."""
        times = (at for at, each in self.events if each == what and since <= at <= until)
        return next(times, None)


@contextmanager
def board_on_a_terminal() -> Iterator[PtyBoard]:
    """Run a board for as long as the context lasts."""
    with helper("reliability.board") as process:
        board = PtyBoard(first_line(process), process.pid)
        reader = threading.Thread(target=_read, args=(board, process), daemon=True)
        reader.start()
        try:
            yield board
        finally:
            process.kill()
            reader.join(5.0)


def _read(board: PtyBoard, process: Process) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        at, what = json.loads(line)
        board.events.append((at, what))


def main() -> None:
    """Serve until killed."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    print(os.ttyname(slave), flush=True)
    request_priority()
    board = SimulatedBoard()
    deframer = Deframer()
    state = ""
    while True:
        # Bytes wake the loop at once; without any it wakes after TURN_S, so that the simulated
        # plate's time goes on.
        ready, _, _ = select.select([master], [], [], TURN_S)
        data = os.read(master, READ_BYTES) if master in ready else b""
        now = time.monotonic()
        for frame in deframer.feed(data):
            if isinstance(plate_protocol.decode(frame), plate_protocol.Off):
                print(json.dumps((now, OFF)), flush=True)
        out = board.exchange(data, now)
        if board.plate.state.name != state:
            state = board.plate.state.name
            print(json.dumps((time.monotonic(), state)), flush=True)
        if out:
            os.write(master, out)


if __name__ == "__main__":
    main()
