"""Drives a plate on a serial line: one thread reads and writes the port, and nobody waits for it.

The protocol is in `session.py`; this module owns the port around it. The port may vanish at any
time and is opened again with growing pauses. Opening it resets most boards (through DTR), which is
expected and harmless: a board starts with its bridge open. It is not harmless for other people's
boards, so after a loss only the plate's own USB socket is opened again, and each port that newly
appears with the plate's descriptor, once (`ports.py` says what is opened at the start).

Two threads meet here. The gateway's event loop commands, rests and asks for the reading. The
plate's own thread reads and writes the port, and each read may block for READ_S. Both use the
session, a plain state machine, under one lock. The lock is held while something is computed and
never over a read or a write, so the event loop waits for microseconds. If the serial driver hangs,
it holds up the plate's thread alone. If this process dies, the time to live of the last setpoint
ends on the board, which then switches off by itself.
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
from hapticvlm.devices.faults import Fault
from hapticvlm.devices.plate import known_plates, ports
from hapticvlm.devices.plate.known_plates import UsbIdentity
from hapticvlm.devices.plate.ports import Port, PortInfo
from hapticvlm.devices.plate.protocol import Answer
from hapticvlm.devices.plate.session import PlateSession
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.heat.limits import PlateReading

CLEAR_S = 1.0  # for the board to answer
KEEP_LAG_S = 12.0  # for a return to neutral, and the answer
HANDSHAKE_S = 8.0  # a boot loader that waits for a program is deaf for up to 6 s
READ_BYTES = 256
REOPEN_PAUSES_S = (
    0.25,
    0.5,
    1.0,
    2.0,
    5.0,
)  # before each try to open the port again, then the last
SIGN_OFF_S = 0.5  # for the board to acknowledge the last off
TURN_S = 0.018  # between polls of a simulated board: a tick, less what a clock may be off
JOIN_S = 2.0
NO_PLATE = (
    "bytes came, but no whole message: is it a plate, and does no other program read the port? "
    "Firmware is written by hapticvlm plate flash"
)
PRIORITY = 15  # above the gateway's loop, whose orders this thread sends, below the audio thread's

logger = logging.getLogger(__name__)


class Peltier:
    """A plate behind a serial port, for use from any thread.

    Call `start` to have a thread follow the port, or `connect` and then `poll` in lock-step.
    """

    def __init__(
        self,
        address: str,
        *,
        open_port: Callable[[str], Port] = ports.open_port,
        clock: Callable[[], float] = time.monotonic,
        simulated: bool = False,
        realtime: bool = False,
    ) -> None:
        """Open nothing yet. `address` is a port, a pyserial URL or `auto`.

        `clock` returns seconds and is the clock of every `now`. With `realtime` the thread asks for
        real-time priority, so that a stop does not wait for a busy event loop.
        """
        self.simulated = simulated
        self.name = "simulated plate" if simulated else address
        self.firmware = "unknown"  # until a board has answered
        self._address = address
        self._realtime = realtime
        self._open_port = open_port
        self._clock = clock
        self._session = PlateSession()
        self._lock = threading.Lock()  # guards the session, and taking the port away
        self._port: Port | None = None
        self._polled_at = -math.inf
        self._failure = ""  # reason why the port was closed last
        self._port_info: PortInfo | None = None  # of the port that was opened last
        self._own: PortInfo | None = None  # of the port at which the plate answered last
        self._strangers: frozenset[UsbIdentity] = frozenset()  # present at the loss, or asked since
        self._attempts = 0  # to open the port again, since the board answered last
        self._reopen_at = math.inf
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def counts(self) -> dict[str, int]:
        """Number of each kind of irregularity on the line, here and on the board, by name."""
        with self._lock:
            return self._session.counts

    def start(self) -> None:
        """Connect, then follow the port in a thread until `close`. Raises DeviceError."""
        self.connect()
        self._thread = threading.Thread(target=self._run, name="plate", daemon=True)
        self._thread.start()

    def connect(self) -> None:
        """Open the port and wait until the board answers. Raises DeviceError, naming each port."""
        failures = []
        alone = [PortInfo(self._address, "")]
        for port_info in alone if self.simulated else ports.candidate_ports(self._address):
            try:
                self._open(port_info)
                self._handshake()
            except DeviceError as error:
                failures.append(f"{port_info.text}: {error}")
                continue
            return
        raise DeviceError(f"no plate answered; {'; '.join(failures)}")

    def poll(self) -> None:
        """Read once, for at most READ_S, then write what is due; a port that fails is closed.

        Without an open port, open it again when that is due.
        """
        if self._port is None:
            self._reopen_when_due()
            return
        try:
            # Read and write happen outside the lock, so that a serial adapter that hangs in the
            # kernel holds up this thread and nobody else. The session computes under the lock. A
            # command that must be sent at once ends the read (`_end_read`); where the port cannot
            # end a read, the command is sent after it.
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
        if self._session.is_ready and self._own is not self._port_info:
            self._name()
        if is_gone:
            self._disconnect(NO_PLATE, self._session.silence(now))

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` (degC) for `ttl_s`; the thread ends its read to send it at once."""
        with self._lock:
            if self._session.command(setpoint_c, ttl_s, now):
                self._end_read()

    def rest(self, now: float) -> None:  # noqa: ARG002 - the board's clock decides
        """Return to neutral, then switch off."""
        with self._lock:
            self._session.rest()
            self._end_read()

    def off(self, now: float) -> None:  # noqa: ARG002 - the board's clock decides
        """Open the bridge at once; the thread ends its read to send it."""
        with self._lock:
            self._session.off()
            self._end_read()

    def advance(self, now: float) -> PlateReading:
        """Return the plate's last reading; temperatures are None when it is too old."""
        with self._lock:
            # The thread of a simulated board shares the interpreter with the event loop, and its
            # computing would delay a touch. So the board is advanced when the loop asks for the
            # reading, which is just after a touch, and not at moments of its own.
            if self.simulated and self._session.is_moving and now - self._polled_at >= TURN_S:
                self._end_read()
            return self._session.reading(now)

    def clear(self, fault: str) -> None:
        """Unlatch one fault, given its name or number, and wait for the answer.

        Blocks for up to CLEAR_S, so do not call it on an event loop. Raises DeviceError if the
        board refuses or does not answer, ValueError if there is no such fault.
        """
        number = faults.number_of(fault)
        with self._lock:
            self._session.clear(number)
        answer = self._await_answer(CLEAR_S)
        if answer is Answer.NOT_LATCHED:
            raise DeviceError(f"{faults.FIRMWARE[number].name} is not latched")
        if answer is Answer.PERSISTS:
            raise DeviceError(f"its cause is still there. {faults.FIRMWARE[number].text}")
        if answer is not Answer.OK:
            reply = "nothing" if answer is None else answer.name.lower()
            raise DeviceError(f"the board answered {reply} to clear {number}; try again")

    @property
    def lag_s(self) -> float | None:
        """Lag of the plate's thermistors as the board keeps it, in s; None if it has none."""
        return self._session.lag_s

    def keep_lag(self, lag_s: float) -> None:
        """Store the lag of the plate's thermistors (s, 0 to 1) on the board, for good.

        The board takes it only while the plate is off, so this waits for a return to neutral.
        Blocks for up to KEEP_LAG_S. Raises DeviceError when the board refuses or is too old.
        """
        until = self._clock() + KEEP_LAG_S
        answer: Answer | None = Answer.DRIVING
        while answer is Answer.DRIVING and self._clock() < until:
            with self._lock:
                self._session.keep_lag(lag_s)
            answer = self._await_answer(until - self._clock())
        if answer is Answer.UNKNOWN:
            raise DeviceError(
                "its firmware is older than 1.4 and keeps no lag: hapticvlm plate flash"
            )
        if answer is not Answer.OK:
            reply = "nothing" if answer is None else answer.name.lower()
            raise DeviceError(f"the board answered {reply} to a lag of {lag_s:g} s; try again")

    def close(self) -> None:
        """Switch the plate off and close the port; blocks for a fraction of a second."""
        if self._closing.is_set():
            return
        self._closing.set()
        if self._thread is not None:
            self._thread.join(JOIN_S)
            if self._thread.is_alive():
                logger.error(
                    "%s: the port does not respond within %g s and stays open; the lease on the "
                    "board ends the heat",
                    self.name,
                    JOIN_S,
                )
                return
        self._sign_off()

    def _end_read(self) -> None:
        """End the thread's read, so that it sends what is due at once; call it under the lock."""
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
                return
        silence = f"no answer within {HANDSHAKE_S:g} s"
        if self._session.silence(self._clock()) is faults.GARBLED:
            silence = NO_PLATE
        failure = self._session.refusal or self._failure or silence
        self._disconnect(failure)
        self._session = PlateSession()
        raise DeviceError(failure)

    def _name(self) -> None:
        board = self._session.board
        self._own = self._port_info
        if self.simulated or self._port_info is None or board is None:
            return
        ports.remember(self._port_info)
        self.firmware = f"{board.firmware} (board {board.board_id})"
        self.name = (
            f"plate on {self._port_info.url}, firmware {board.firmware}, board {board.board_id}"
        )

    def _disconnect(self, failure: str, loss: Fault = faults.UNPLUGGED) -> None:
        self._failure = failure
        if self._session.is_ready:
            # An open port is not yet a plate: another device may be there, or a boot loader. So
            # the pauses grow until a board has answered, and only then start from the first.
            self._attempts = 0
            self._strangers = frozenset(
                place.usb for place in self._present() if place.usb is not None
            )
        elif self._session.speaks_text and self._port_info and self._port_info.usb:
            known_plates.avoid(self._port_info.usb)
        self._pause()
        with self._lock:
            # The port is taken away under the lock, so that `off` finds either an open port or
            # none and never ends a read of a port that is being closed. It is closed outside the
            # lock, because closing may block in the driver of an adapter that was pulled out.
            port = self._port
            self._port = None
            self._session.lost(loss)
        if port is not None:
            with contextlib.suppress(OSError):
                port.close()

    def _run(self) -> None:
        if self._realtime:
            request_priority(PRIORITY)
        while not self._closing.is_set():
            if self._port is None:
                self._closing.wait(ports.READ_S)
            self.poll()

    def _pause(self) -> None:
        pause_s = REOPEN_PAUSES_S[min(self._attempts, len(REOPEN_PAUSES_S) - 1)]
        self._reopen_at = self._clock() + pause_s

    def _reopen_when_due(self) -> None:
        own = self._own
        if own is None or self._closing.is_set() or self._clock() < self._reopen_at:
            return
        self._attempts += 1
        self._pause()
        place = self._place_of(own)
        if place is None:
            return
        try:
            self._open(place)
        except (DeviceError, OSError) as error:
            logger.debug("plate: %s", error)

    def _place_of(self, own: PortInfo) -> PortInfo | None:
        """Return the port to open for a plate that was lost; None if it is not there."""
        if own.usb is None:
            return own
        present = [(place, place.usb) for place in self._present() if place.usb is not None]
        known = known_plates.forget_unplugged([usb for _, usb in present])
        present = [(place, usb) for place, usb in present if known.may_open(usb)]
        self._strangers &= {usb for _, usb in present}  # one that went may come back as a new one
        at_socket = [place for place, usb in present if usb == own.usb]
        is_new = [
            (place, usb)
            for place, usb in present
            if usb.descriptor == own.usb.descriptor and usb not in self._strangers
        ]
        if self._address != ports.AUTO:
            is_there = ports.is_present(self._address)
            if not is_there and (at_socket or is_new):
                with self._lock:
                    self._session.lost(faults.RENAMED)
            return own if is_there else None
        if at_socket:
            return at_socket[0]
        if not is_new:
            return None
        place, usb = is_new[0]
        self._strangers |= {usb}
        return place

    def _present(self) -> list[PortInfo]:
        return [] if self.simulated else ports.present()

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
