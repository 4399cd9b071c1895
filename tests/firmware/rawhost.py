"""A host that can do what the service never does: stop sending, or send any bytes."""

from __future__ import annotations

from collections.abc import Callable

from hapticvlm.devices.plate.framing import Deframer

from . import line
from .board import Board
from .line import Telemetry

RENEW_S = 0.1  # as in the service: well within the time to live
TTL_S = 0.25
SWITCHED_ON_S = 0.6  # by then board and cut-out have started
_SLICE_S = 0.01

Course = Callable[[float], float]  # seconds since its start -> setpoint_c


class RawHost:
    """Communicates with one board in simulated time and stores its messages."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.telemetry: Telemetry | None = None
        self.acks: list[tuple[int, int, str]] = []  # type, seq, answer
        self.greetings: list[bytes] = []
        self._seq = 0
        self._deframer = Deframer()

    @property
    def damaged(self) -> int:
        """Number of damaged frames from the board."""
        return self._deframer.bad

    def send(self, type: int, payload: bytes = b"") -> int:
        """Queue one message; return its seq."""
        self._seq = (self._seq + 1) % 256
        self.board.write(line.frame(type, self._seq, payload))
        return self._seq

    def ask(self, type: int, payload: bytes = b"") -> str:
        """Send one message and return its answer; "" after 0.2 s without one."""
        seq = self.send(type, payload)
        for _ in range(20):
            self.advance(_SLICE_S)
            found = [answer for of, nr, answer in self.acks if (of, nr) == (type, seq)]
            if found:
                return found[-1]
        return ""

    def greet(self) -> None:
        """Let the board start and send HELLO."""
        self.advance(SWITCHED_ON_S)
        answer = self.ask(line.HELLO, b"\x01\x00")
        if answer != "ok":
            raise RuntimeError(f"the board answered HELLO with {answer!r}")

    def advance(self, seconds: float) -> None:
        """Advance time without sending; store the messages of the board."""
        for _ in range(round(seconds / _SLICE_S)):
            self.board.advance(_SLICE_S)
            self._listen()

    def follow(
        self, course: Course, seconds: float, *, until: Callable[[], bool] | None = None
    ) -> None:
        """Renew the setpoint of `course` for `seconds`, or until a condition holds."""
        for step in range(round(seconds / RENEW_S)):
            self.send(line.SETPOINT, line.setpoint(course(step * RENEW_S), TTL_S))
            self.advance(RENEW_S)
            if until is not None and until():
                return

    def hold(self, setpoint_c: float, seconds: float) -> None:
        """Renew one setpoint for `seconds`."""
        self.follow(lambda _: setpoint_c, seconds)

    def state(self) -> Telemetry:
        """Return telemetry newer than this call."""
        self.telemetry = None
        self.advance(0.1)
        if self.telemetry is None:
            raise RuntimeError("the board sends no telemetry")
        return self.telemetry

    def _listen(self) -> None:
        for received in self._deframer.feed(self.board.read()):
            match line.said(received):
                case Telemetry() as telemetry:
                    self.telemetry = telemetry
                case (of, seq, answer):
                    self.acks.append((of, seq, answer))
            if received.kind == line.HELLO_REPLY:
                self.greetings.append(received.payload)
