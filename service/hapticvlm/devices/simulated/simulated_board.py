"""Simulates a board: the simulated plate behind the bytes of the serial protocol.

It answers as `firmware/PROTOCOL.md` states, so that `Peltier` drives it like a real board. It has
the guards of the simulated plate, which are fewer than the firmware's; the firmware itself is
tested as a compiled binary.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from hapticvlm.devices import faults
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer, Frame
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.ports import READ_S
from hapticvlm.devices.plate.protocol import (
    Answer,
    Clear,
    Hello,
    HelloReply,
    Message,
    Setpoint,
    Telemetry,
)
from hapticvlm.devices.simulated.simulated import (
    COOL_LIMIT_A,
    HEAT_LIMIT_A,
    TICK_S,
    SimulatedPlate,
)
from hapticvlm.rendering.heat import limits as plate_limits

TELEMETRY_HZ = 20
FULL_SCALE_A = 3.0  # of the assumed driver, as in PROTOCOL.md
_POWER_ON = 1 << 0
_UNSENT_BYTES = 4096  # a host that does not read loses what is beyond


class SimulatedBoard:
    """Receives and returns the bytes of the line; time passes only in `exchange`."""

    def __init__(
        self, plate: SimulatedPlate | None = None, *, major: int = plate_protocol.MAJOR
    ) -> None:
        self.plate = plate or SimulatedPlate()
        self._major = major
        self._deframer = Deframer()
        self._started_at: float | None = None
        self._advanced_to = 0.0
        self._reported_at = 0.0
        self._seq = self._refused = 0
        self._has_handshake = False

    @property
    def has_handshake(self) -> bool:
        """Whether the host's HELLO was accepted; from then on it sends telemetry and replies."""
        return self._has_handshake

    def exchange(self, data: bytes, now: float) -> bytes:
        """Handle the host's bytes, advance to `now` and return the bytes to send."""
        if self._started_at is None:
            self._started_at = self._reported_at = self._advanced_to = now
        frames = self._deframer.feed(data)
        self._advance(now, is_at_rest=not frames and self.plate.state is plate_protocol.State.OFF)
        out = b"".join(self._handle(received) for received in frames)
        if now - self._reported_at >= 1.0 / TELEMETRY_HZ:
            self._reported_at = now
            out += self._encode(self._telemetry(now))
        return out

    def _advance(self, now: float, *, is_at_rest: bool) -> None:
        """Advance the plate to `now`, at rest only in whole steps of its control loop.

        The host calls at any moment, and each step length has its own system of equations to solve.
        At rest nobody notices a difference of less than a step, and equal steps are solved once.
        """
        if is_at_rest and self._advanced_to <= now < math.inf:
            self._advanced_to += math.floor((now - self._advanced_to) / TICK_S) * TICK_S
        else:
            self._advanced_to = now
        self.plate.advance(self._advanced_to)

    def _handle(self, received: Frame) -> bytes:
        try:
            message = plate_protocol.decode(received)
        except plate_protocol.LineError:
            answer = Answer.LENGTH if received.kind in range(0x01, 0x07) else Answer.UNKNOWN
            return self._acknowledge(received, answer)
        reply = b""
        if isinstance(message, Hello):
            beads = plate_protocol.Beads(round(self.plate.lag_s * 1000))
            reply = plate_protocol.encode(self._hello_reply(), received.seq)
            reply += plate_protocol.encode(beads, received.seq)
        return reply + self._acknowledge(received, self._do(message))

    def _do(self, message: Message) -> Answer:
        match message:
            case Hello():
                return self._handshake(message)
            case Setpoint():
                return self._hold(message)
            case plate_protocol.Off():
                self.plate.close()
            case plate_protocol.Rest():
                self.plate.rest(self._advanced_to)
            case Clear():
                return self._clear(message.fault) if self._has_handshake else Answer.NEEDS_HELLO
            case plate_protocol.Lag():
                return self._keep_lag(message)
            case _:
                return Answer.UNKNOWN
        return Answer.OK

    def _handshake(self, message: Hello) -> Answer:
        self._has_handshake = message.major == self._major
        if self._has_handshake:
            return Answer.OK
        self.plate.close()
        return Answer.VERSION

    def _hold(self, message: Setpoint) -> Answer:
        if not self._has_handshake:
            return Answer.NEEDS_HELLO
        setpoint_c = message.setpoint_mc / 1000.0
        if not plate_limits.SETPOINT_MIN_C <= setpoint_c <= plate_limits.SETPOINT_MAX_C:
            return Answer.RANGE
        if not 1 <= message.ttl_ms <= plate_protocol.MAX_TTL_MS:
            return Answer.TTL
        if self.plate.state is plate_protocol.State.FAULTED:
            return Answer.FAULTED
        self.plate.command(setpoint_c, message.ttl_ms / 1000.0, self._advanced_to)
        return Answer.OK

    def _keep_lag(self, message: plate_protocol.Lag) -> Answer:
        if not self._has_handshake:
            return Answer.NEEDS_HELLO
        if message.lag_ms > plate_protocol.MAX_LAG_MS:
            return Answer.RANGE
        if self.plate.state in (plate_protocol.State.HOLDING, plate_protocol.State.RETURNING):
            return Answer.DRIVING
        self.plate.lag_s = message.lag_ms / 1000.0
        return Answer.OK

    def _clear(self, number: int) -> Answer:
        fault = faults.FIRMWARE.get(number)
        if fault is None or fault.name not in self.plate.faults:
            return Answer.NOT_LATCHED
        return Answer.OK if self.plate.clear(fault.name) else Answer.PERSISTS

    def _acknowledge(self, received: Frame, answer: Answer) -> bytes:
        self._refused += answer is not Answer.OK
        return self._encode(plate_protocol.Ack(received.kind, received.seq, answer))

    def _encode(self, message: Message) -> bytes:
        self._seq = (self._seq + 1) % 256
        return plate_protocol.encode(message, self._seq)

    def _hello_reply(self) -> HelloReply:
        return HelloReply(
            major=self._major,
            minor=plate_protocol.MINOR,
            firmware_major=0,
            firmware_minor=0,
            firmware_patch=0,
            board_id=0,
            setpoint_low_mc=round(plate_limits.SETPOINT_MIN_C * 1000),
            setpoint_high_mc=round(plate_limits.SETPOINT_MAX_C * 1000),
            slew_mc_s=round(plate_limits.COOL_SLEW_C_PER_S * 1000),
            max_ttl_ms=plate_protocol.MAX_TTL_MS,
            heat_limit_ma=round(HEAT_LIMIT_A * 1000),
            cool_limit_ma=round(COOL_LIMIT_A * 1000),
            heat_cap=_permille(HEAT_LIMIT_A),
            cool_cap=_permille(COOL_LIMIT_A),
            telemetry_hz=TELEMETRY_HZ,
            reset_cause=_POWER_ON,
        )

    def _telemetry(self, now: float) -> Telemetry:
        reading = self.plate.advance(self._advanced_to)
        state = self.plate.state
        is_driving = state in (plate_protocol.State.HOLDING, plate_protocol.State.RETURNING)
        plate_mc = None if reading.plate_c is None else round(reading.plate_c * 1000)
        return Telemetry(
            uptime_ms=round((now - (self._started_at or 0.0)) * 1000) % 2**32,
            state=state,
            faults=sum(1 << faults.number_of(name) for name in reading.faults),
            plate_mc=plate_mc,
            plate2_mc=plate_mc,
            sink_mc=None if reading.sink_c is None else round(reading.sink_c * 1000),
            setpoint_mc=round(reading.setpoint_c * 1000) if is_driving else None,
            duty=_permille(self.plate.current_a),
            limited=plate_protocol.LIMITED_BY_CURRENT if reading.current_limited else 0,
            bad_frames=min(self._deframer.bad, 0xFFFF),
            refused=min(self._refused, 0xFFFF),
            dose_mcem43=min(round(reading.dose_cem43 * 1000), 0xFFFF),
            heated_s=min(int(reading.heated_s), 0xFFFF),
            reset_cause=_POWER_ON,
        )


class SimulatedPort:
    """A port with a simulated board behind it; `wait` passes time in s on the clock."""

    def __init__(
        self,
        board: SimulatedBoard,
        clock: Callable[[], float] = time.monotonic,
        wait: Callable[[float], object] | None = None,
    ) -> None:
        self._cancelled = threading.Event()
        self._board = board
        self._clock = clock
        self._wait = wait or self._cancelled.wait
        self._pending = b""

    def read(self, size: int) -> bytes:
        """Wait as a real port does, then return up to `size` bytes that the board sent."""
        if not self._cancelled.is_set():
            self._wait(self.longest_read_s())
        self._cancelled.clear()
        self._exchange(b"")
        received = self._pending[:size]
        self._pending = self._pending[size:]
        return received

    def longest_read_s(self) -> float:
        """Return the longest time in s for which a read may wait.

        After the handshake the board sends nothing before its next telemetry, except for replies to
        orders, and an order ends the read. A thread that wakes less often delays fewer touches.
        """
        return 1.0 / TELEMETRY_HZ if self._board.has_handshake else READ_S

    def write(self, data: bytes) -> int:
        """Pass bytes to the board and return how many."""
        self._exchange(data)
        return len(data)

    def cancel_read(self) -> None:
        """End the current read, or the next one if there is none."""
        self._cancelled.set()

    def close(self) -> None:
        """Do nothing; the board continues by itself."""

    def _exchange(self, data: bytes) -> None:
        self._pending += self._board.exchange(data, self._clock())
        self._pending = self._pending[:_UNSENT_BYTES]


def simulated_plate(*, realtime: bool = False) -> Peltier:
    """Return a `Peltier` on a simulated board; start it like one on a real board."""
    board = SimulatedBoard()
    return Peltier(
        "simulated",
        open_port=lambda _: SimulatedPort(board),
        simulated=True,
        realtime=realtime,
    )


def _permille(current_a: float) -> int:
    return round(current_a / FULL_SCALE_A * 1000.0)
