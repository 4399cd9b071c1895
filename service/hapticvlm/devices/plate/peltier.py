"""The plate on a serial line: one thread reads and writes the port, nobody else waits for it.

The protocol is `plate_session.py`'s business; this is the port around it, which may vanish at any
time and is opened again with growing pauses. Opening resets most boards (DTR): expected.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable

from hapticvlm.devices import faults
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.plate import ports
from hapticvlm.devices.plate.ports import Port, PortInfo
from hapticvlm.devices.plate.protocol import Answer
from hapticvlm.devices.plate.session import PlateSession
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.heat.limits import PlateReading

HANDSHAKE_S = 5.0  # the slowest boot loader took 1.4 s to the first telemetry
READ_BYTES = 256
REOPEN_PAUSES_S = (
    0.25,
    0.5,
    1.0,
    2.0,
    5.0,
)  # before each try to open the port again, then the last
SIGN_OFF_S = 0.5
TURN_S = 0.018  # of a simulated board: a tick, less what a clock may be off
JOIN_S = 2.0
PRIORITY = 15  # above the gateway's loop, whose orders it sends, below the audio's

logger = logging.getLogger(__name__)


class Peltier:
    """A plate behind a port: `start` it, or `connect` and then call `poll` in lock-step."""

    def __init__(
        self,
        address: str,
        *,
        open_port: Callable[[str], Port] = ports.open_port,
        clock: Callable[[], float] = time.monotonic,
        simulated: bool = False,
        realtime: bool = False,
    ) -> None:
        """`address` is a port, a pyserial URL or `auto`; `clock` is the one `now` comes from.

        With `realtime` the thread asks for that priority: a stop must not wait for a busy loop.
        """
        self.simulated = simulated
        self.name = "simulated plate" if simulated else address
        self.firmware = "unknown"  # until a board has answered
        self._address = address
        self._realtime = realtime
        self._open_port = open_port
        self._clock = clock
        self._session = PlateSession()
        # Two threads meet here. The gateway's event loop commands, rests and asks for the reading;
        # the plate's own thread reads and writes the port, which may block for READ_S. Both go
        # through the session, a plain state machine, under this lock, which is held for computing
        # only and never over a read or a write: the loop waits for microseconds. A stop does not
        # wait for the read either, `off` cancels it. If this process dies, nothing here matters:
        # the setpoint's own time to live ends on the board.
        self._lock = threading.Lock()
        self._port: Port | None = None
        self._polled_at = -math.inf
        self._failure = ""  # why the port was closed last
        self._port_info: PortInfo | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def counts(self) -> dict[str, int]:
        """What did not fit on the line, here and on the board."""
        with self._lock:
            return self._session.counts

    def start(self) -> None:
        """Connect, then follow the port in a thread until closed. Raises DeviceError."""
        self.connect()
        self._thread = threading.Thread(target=self._run, name="plate", daemon=True)
        self._thread.start()

    def connect(self) -> None:
        """Open the port and wait for the board's answer. Raises DeviceError, naming each port."""
        failures = []
        for port_info in ports.candidate_ports(self._address):
            try:
                self._open(port_info)
                self._handshake()
            except DeviceError as error:
                failures.append(f"{port_info.text}: {error}")
                continue
            return
        raise DeviceError(f"no plate answered; {'; '.join(failures)}")

    def poll(self) -> None:
        """Read once, for at most READ_S, then write what is due; a failing port is closed."""
        if self._port is None:
            return
        try:
            # The read blocks for READ_S at most and outside the lock: a serial adapter that hangs
            # in the kernel holds up this thread and nobody else. Everything between is computed
            # under the lock, and what it gives is written outside again. What is commanded and
            # is to be sent at once ends the read; where a port cannot do that it is sent after it.
            data = self._port.read(READ_BYTES)
            now = self._polled_at = self._clock()
            with self._lock:
                self._session.receive(data, now)
                out = self._session.outgoing(now)
                is_gone = self._session.is_gone(now)
            if out:
                self._port.write(out)
        except OSError as error:  # pyserial's own errors are among them
            self._disconnect(str(error))
            return
        if is_gone:
            self._disconnect("nothing understandable came")

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` for `ttl_s`; sent by the thread without waiting for its read to end."""
        with self._lock:
            if self._session.command(setpoint_c, ttl_s, now):
                self._end_read()

    def rest(self, now: float) -> None:  # noqa: ARG002 - the board's clock decides
        """Return to neutral, then switch off."""
        with self._lock:
            self._session.rest()
            self._end_read()

    def off(self, now: float) -> None:  # noqa: ARG002 - the board's clock decides
        """Open the bridge at once; sent by the thread without waiting for its read to end."""
        with self._lock:
            self._session.off()
            self._end_read()

    def advance(self, now: float) -> PlateReading:
        """Return the plate's last reading; nothing measured if that is too long ago."""
        with self._lock:
            # The thread of a simulated board shares the interpreter with the event loop, and what
            # it computes holds up a touch. So it lives on when the loop looks at it, which is just
            # after a touch, and not at moments of its own.
            if self.simulated and self._session.is_moving and now - self._polled_at >= TURN_S:
                self._end_read()
            return self._session.reading(now)

    def clear(self, named: str, patience_s: float = 1.0) -> None:
        """Unlatch one fault, by name or number; waits for the answer, so not on an event loop.

        Raises DeviceError if the board refuses or does not answer, ValueError for no such fault.
        """
        number = faults.numbered(named)
        with self._lock:
            self._session.clear(number)
        answer = self._await_answer(patience_s)
        if answer is Answer.NOT_LATCHED:
            raise DeviceError(f"{faults.FIRMWARE[number].name} is not latched")
        if answer is Answer.PERSISTS:
            raise DeviceError(f"its cause is still there. {faults.FIRMWARE[number].text}")
        if answer is not Answer.OK:
            reply = "nothing" if answer is None else answer.name.lower()
            raise DeviceError(f"the board answered {reply} to clear {number}")

    def close(self) -> None:
        """Switch the plate off and close the port; waits for a fraction of a second."""
        if self._closing.is_set():
            return
        self._closing.set()
        if self._thread is not None:
            self._thread.join(JOIN_S)
            if self._thread.is_alive():
                logger.error("%s: the port is stuck; the board's lease ends the heat", self.name)
                return
        self._sign_off()

    def _end_read(self) -> None:
        """Let the thread send at once what it would send when its read ends; under the lock."""
        cancel = getattr(self._port, "cancel_read", None)  # pyserial's socket:// has none
        if cancel is not None:
            with contextlib.suppress(OSError):
                cancel()

    def _open(self, port_info: PortInfo) -> None:
        self._port = self._open_port(port_info.url)
        self._port_info = port_info
        with self._lock:
            self._session.opened(self._clock())

    def _handshake(self) -> None:
        """Poll until the board has answered. Raises DeviceError, with the port closed."""
        until = self._clock() + HANDSHAKE_S
        while self._port is not None and self._clock() < until:
            self.poll()
            if self._session.refusal is not None:
                break
            if self._session.is_ready and self._session.telemetry is not None:
                self._name()
                return
        failure = self._session.refusal or self._failure or f"no answer within {HANDSHAKE_S:g} s"
        self._disconnect(failure)
        self._session = PlateSession()
        raise DeviceError(failure)

    def _name(self) -> None:
        board = self._session.board
        if self.simulated or self._port_info is None or board is None:
            return
        version = f"{board.firmware_major}.{board.firmware_minor}.{board.firmware_patch}"
        self.firmware = f"{version} (board {board.board_id})"
        self.name = f"plate on {self._port_info.url}, firmware {version}, board {board.board_id}"

    def _disconnect(self, failure: str) -> None:
        self._failure = failure
        with self._lock:  # nobody cancels a read of what is being closed
            # The port is taken away under the lock and closed outside it: closing may block in the
            # driver of an adapter that was pulled out, and `off` must find either a port that is
            # open or none.
            port = self._port
            self._port = None
            self._session.lost()
        if port is not None:
            with contextlib.suppress(OSError):
                port.close()

    def _run(self) -> None:
        if self._realtime:
            request_priority(PRIORITY)
        attempts = 0
        while not self._closing.is_set():
            if self._port is not None:
                self.poll()
                # A port that opens is no plate yet: another device may answer there, or a boot
                # loader. So the pauses grow until a board has answered, and only then begin anew.
                attempts = 0 if self._session.is_ready else attempts
            elif not self._closing.wait(REOPEN_PAUSES_S[min(attempts, len(REOPEN_PAUSES_S) - 1)]):
                self._reopen(attempts)
                attempts += 1

    def _reopen(self, attempts: int) -> None:
        """Try one port that may be the same plate; which one goes round."""
        known = None if self._port_info is None else self._port_info.usb
        try:
            found = [
                port_info
                for port_info in ports.candidate_ports(self._address)
                if port_info.usb == known
            ]
            if found:
                self._open(found[attempts % len(found)])
        except (DeviceError, OSError) as error:
            logger.debug("plate: %s", error)

    def _await_answer(self, patience_s: float) -> Answer | None:
        until = self._clock() + patience_s
        while self._session.is_busy and self._clock() < until:
            if self._thread is None:
                self.poll()
            else:
                time.sleep(ports.READ_S)
        return self._session.answer

    def _sign_off(self) -> None:
        if self._port is None:
            return
        with self._lock:
            self._session.off()
        until = self._clock() + SIGN_OFF_S
        while self._port is not None and self._session.is_busy and self._clock() < until:
            self.poll()
        self._disconnect("closed")
        with self._lock:
            self._session.ended()
