"""The pyserial URL `sim://NAME`: a port whose other end is a simulated board.

A blocking read advances simulated time instead of waiting, so the unmodified service
runs in lock-step with the chip. Register a board in BOARDS, and this package in pyserial's
`protocol_handler_packages`. Opening resets the board, as DTR does on an Uno or Nano.
"""

from __future__ import annotations

import math
from typing import Any

from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from .board import RESET_EXTERNAL, Board
from .rawhost import SWITCHED_ON_S

BOARDS: dict[str, Board] = {}
POLL_S = 0.004


class Serial(SerialBase):  # type: ignore[misc]
    """The port behind a sim:// URL."""

    def open(self) -> None:
        """Find the board and reset it. Raises SerialException for an unknown name."""
        name = str(self.portstr).removeprefix("sim://")
        if name not in BOARDS:
            raise SerialException(f"no simulated board {name!r}")
        self._board: Board = BOARDS[name]
        self._received = bytearray()
        self._board.advance(max(SWITCHED_ON_S - self._board.now, 0.0))
        self._board.reset(RESET_EXTERNAL)
        self._board.read()
        self.is_open = True

    def close(self) -> None:
        """Close the port; the board keeps running."""
        self.is_open = False

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        self._received += self._board.read()
        return len(self._received)

    def read(self, size: int = 1) -> bytes:
        """Return up to `size` bytes, after at most the timeout in simulated time."""
        if not self.is_open:
            raise PortNotOpenError
        timeout_s = math.inf if self._timeout is None else self._timeout
        until = self._board.now + timeout_s
        while self.in_waiting < size and self._board.now < until:
            self._board.advance(POLL_S)
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def write(self, data: bytes) -> int:
        """Queue bytes on the line."""
        if not self.is_open:
            raise PortNotOpenError
        return self._board.write(bytes(data))

    def flush(self) -> None:
        """Do nothing: bytes are sent automatically."""

    def reset_input_buffer(self) -> None:
        """Drop all received bytes."""
        self._received += self._board.read()
        self._received.clear()

    def reset_output_buffer(self) -> None:
        """Do nothing: queued bytes are already being sent."""

    def _reconfigure_port(self, *_: Any, **__: Any) -> None:
        """Accept any settings."""

    def _update_dtr_state(self) -> None:
        """Accept any line state."""

    _update_rts_state = _update_dtr_state
