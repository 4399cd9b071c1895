"""Speaks the host's half of the plate's protocol: bytes and `now` in, bytes and readings out.

Sans-I/O: the owner of the port calls `opened`, `receive` and `lost`, and writes what `outgoing`
returns, many times a second. It also serialises the calls, since nothing here takes a lock.

The plate is driven only after the board has answered a HELLO with our major version. Every setpoint
carries the time that is left of its lease, and none is sent after the lease has ended. So if the
host hangs or dies, the board stops by itself within that time. After a lost port, a reset of the
board or a fault the drive is blocked until a fresh command arrives (`requests.py`). Faults latch in
the firmware until they are cleared by name; the faults that the host finds (unplugged, silent,
wrong version, not following, wrong clock) go when their cause goes. Bytes that do not fit the
protocol are counted; no input raises an error.

Two more things are watched here because the board cannot watch them: whether its own clock runs at
the right rate (`BoardClock`), and the dose of the skin when a reset has erased the board's count
(`Dose`).
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from hapticvlm.devices import faults
from hapticvlm.devices.faults import Fault
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer, Frame
from hapticvlm.devices.plate.protocol import (
    LAG_UNKNOWN_MS,
    Ack,
    Answer,
    Beads,
    HelloReply,
    Message,
    State,
    Telemetry,
)
from hapticvlm.devices.plate.requests import Drive, Orders
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import PlateReading

HELLO_S = 0.25  # between HELLOs; a boot loader swallows the first ones
RX_TIMEOUT_S = 0.5  # without telemetry while the port is read: ten messages are missing
POLL_TIMEOUT_S = 2.0  # without a read of the port: the thread that reads it is stuck
TRACKING_TIMEOUT_S = 0.8  # of setpoints that the board does not follow: a fault within a second
REOPEN_AFTER_S = 3.0  # without any message
FIRST_ANSWER_S = 10.0  # since the port was opened: a boot loader may be deaf for six of them
HEARD_BYTES = 64  # that are kept to tell words from messages
WORD_BYTES = 5  # printable, and nothing else: noise does it once in 60,000 times; our choice
REST_S = 900.0  # without heat before the dose starts from zero: our choice, as long as a session
CLOCK_WINDOW_S = 10.0  # over which the board's clock is compared with ours
MAX_DRIFT = 0.05  # share of time; ceramic resonators are within 0.5 %; our choice
MAX_WRONG_WINDOWS = 2  # in a row before the clock counts as wrong
_UPTIME_WRAPS_MS = 2**32


class PlateSession:
    """One plate, over any number of openings of its port and resets of its board.

    Not thread-safe: the caller holds a lock around every call (`peltier.py`).
    """

    def __init__(self) -> None:
        self.board: HelloReply | None = None
        self.telemetry: Telemetry | None = None
        self.lag_s: float | None = None  # of the plate's thermistors; None if the board has none
        self._counts: Counter[str] = Counter()
        self._deframer = Deframer()
        self._dose = Dose()
        self._drive = Drive()
        self._orders = Orders()
        self._is_open = self._was_open = False
        self._loss = faults.UNPLUGGED
        self._has_answered = False  # since the port was opened
        self._heard = b""  # of it, before a board answered
        self._bytes_at = -math.inf
        self._received_at = self._polled_at = self._hello_at = -math.inf
        self._uptime_ms: int | None = None
        self._unfollowed_since: float | None = None
        self._is_unfollowed = False
        self._clock = BoardClock()

    @property
    def is_ready(self) -> bool:
        """Whether the board has answered our HELLO and speaks our version."""
        return self._is_open and self.board is not None and self.board.refusal is None

    @property
    def refusal(self) -> str | None:
        """Reason why this board cannot be used, with what to do; None if it can."""
        return None if self.board is None else self.board.refusal

    @property
    def is_busy(self) -> bool:
        """Whether an order waits for its acknowledgement."""
        return self._orders.is_waiting

    @property
    def is_moving(self) -> bool:
        """Whether the plate is driven, or on its way back to neutral."""
        return self.telemetry is not None and self.telemetry.state != State.OFF

    @property
    def answer(self) -> Answer | None:
        """The board's answer to the newest order; None until it has answered."""
        return self._orders.answer

    @property
    def counts(self) -> dict[str, int]:
        """Number of dropped frames, ignored commands, resets and losses, here and on the board."""
        telemetry = self.telemetry
        return {
            **self._counts,
            "bad_frames": self._counts["bad_frames"] + self._deframer.bad,
            "commands_ignored": self._drive.ignored,
            "orders_lost": self._orders.lost,
            "board_bad_frames": 0 if telemetry is None else telemetry.bad_frames,
            "board_refused": 0 if telemetry is None else telemetry.refused,
        }

    def opened(self, now: float) -> None:
        """Start the handshake on a port that was just opened.

        Opening a port pulls its DTR line, which resets most boards; that reset is not counted.
        """
        if self._was_open:
            self._counts["reconnects"] += 1
            self._drive.block()
        self._is_open = self._was_open = True
        self._counts["bad_frames"] += self._deframer.bad
        self._deframer = Deframer()
        self._received_at = self._polled_at = now
        self._bytes_at = -math.inf
        self._has_answered = False
        self._heard = b""
        self._forget()

    def lost(self, loss: Fault = faults.UNPLUGGED) -> None:
        """Block the drive, since the port is closed; the lease on the board ends the heat.

        `loss` is the fault that is reported until the port is open again and a board answers.
        """
        self._loss = loss
        if self._is_open:
            self._counts["losses"] += 1
            self._drive.block()
        self._is_open = False
        self._forget()

    def ended(self) -> None:
        """Stop reporting the port as unplugged: it was closed on purpose."""
        self._was_open = False

    def is_gone(self, now: float) -> bool:
        """Return whether an open port delivered no message for so long that it must be reopened.

        Opening resets the board, so a board that is slow to start gets longer for its first answer.
        """
        patience_s = REOPEN_AFTER_S if self._has_answered else FIRST_ANSWER_S
        return self._is_open and now - self._received_at > patience_s

    @property
    def speaks_text(self) -> bool:
        """Whether words came and no message: a printer or a meter, not a plate on a bad line."""
        words = self._heard.replace(b"\r", b" ").replace(b"\n", b" ").decode("latin-1")
        return len(words) >= WORD_BYTES and words.isascii() and words.isprintable()

    def silence(self, now: float) -> Fault:
        """Return the fault of an open port without messages: garbled or silent."""
        return faults.GARBLED if now - self._bytes_at <= RX_TIMEOUT_S else faults.SILENT

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> bool:
        """Hold `setpoint_c` (degC), limited to the band, for `ttl_s`, unless the drive is blocked.

        Returns whether there is something to send at once.
        """
        is_sound = not (self.telemetry and self.telemetry.faults) and not self._clock.is_wrong
        may_drive = self.is_ready and is_sound
        if not self._drive.command(setpoint_c, ttl_s, now, may_drive=may_drive):
            return False
        self._orders.drop_rest()
        return self._drive.is_due(now)

    def rest(self) -> None:
        """End the lease: the board returns to neutral, then switches off."""
        self._order(plate_protocol.Rest())

    def off(self) -> None:
        """Open the bridge at once."""
        self._order(plate_protocol.Off())

    def clear(self, fault: int) -> None:
        """Ask the board to unlatch one fault, by its number; `answer` is its reply."""
        self._order(plate_protocol.Clear(fault))

    def keep_lag(self, lag_s: float) -> None:
        """Ask the board to keep the lag of its thermistors, in s; `answer` is its reply."""
        self._order(plate_protocol.Lag(round(lag_s * 1000.0)))

    def receive(self, data: bytes, now: float) -> None:
        """Handle the bytes read from the port; call it after every read, also one without bytes."""
        self._polled_at = now
        if data:
            self._bytes_at = now
        if not self._has_answered:
            self._heard = (self._heard + data)[:HEARD_BYTES]
        for received in self._deframer.feed(data):
            self._handle(received, now)

    def outgoing(self, now: float) -> bytes:
        """Return the bytes to write now, if any."""
        if not self._is_open or self.refusal is not None:
            return b""
        if self.board is None:
            return self._hello(now)
        setpoint = self._drive.due(now)
        renewed = b"" if setpoint is None else self._orders.encode(setpoint)
        return self._orders.due(now) + renewed

    def reading(self, now: float) -> PlateReading:
        """Return the plate's last reading; temperatures are None when the telemetry is too old."""
        telemetry = self.telemetry if self._is_fresh(now) else None
        dose_cem43, heated_s = self._dose.total
        setpoint_mc = None if telemetry is None else telemetry.setpoint_mc
        duty, current_a = (
            self.board.drive(telemetry.duty) if telemetry and self.board else (0, None)
        )
        return PlateReading(
            plate_c=None if telemetry is None else _celsius(telemetry.plate_mc),
            sink_c=None if telemetry is None else _celsius(telemetry.sink_mc),
            setpoint_c=NEUTRAL_C if setpoint_mc is None else setpoint_mc / 1000.0,
            duty=duty,
            current_limited=telemetry is not None
            and bool(telemetry.limited & plate_protocol.LIMITED_BY_CURRENT),
            dose_cem43=dose_cem43,
            heated_s=heated_s,
            faults=self._faults(now),
            current_a=current_a,
            lag_s=self.lag_s,
        )

    def _is_fresh(self, now: float) -> bool:
        """Return whether the last telemetry still counts.

        A silent board and a stuck reader are told apart: RX_TIMEOUT_S counts up to the last read of
        the port, and POLL_TIMEOUT_S counts from it.
        """
        is_recent = self._polled_at - self._received_at <= RX_TIMEOUT_S
        return self._is_open and is_recent and now - self._polled_at <= POLL_TIMEOUT_S

    def _faults(self, now: float) -> tuple[str, ...]:
        names = () if self.telemetry is None else faults.names(self.telemetry.faults)
        if not self._was_open:
            return names
        if not self._is_open:
            return (*names, self._loss.name)
        if self.refusal is not None:
            return (*names, faults.VERSION.name)
        if self._clock.is_wrong:
            names = (*names, faults.CLOCK_WRONG.name)
        if self._is_unfollowed:
            names = (*names, faults.NOT_FOLLOWED.name)
        return names if self._is_fresh(now) else (*names, self.silence(now).name)

    def _order(self, message: Message) -> None:
        self._drive.rest()
        if self._is_open:
            self._orders.put(message)

    def _forget(self) -> None:
        self.board = self.telemetry = self.lag_s = None
        self._hello_at = -math.inf
        self._orders.drop()
        self._unfollowed_since = None
        self._is_unfollowed = False
        self._clock = BoardClock()

    def _hello(self, now: float) -> bytes:
        if now - self._hello_at < HELLO_S:
            return b""
        self._hello_at = now
        return self._orders.encode(plate_protocol.Hello(plate_protocol.MAJOR, plate_protocol.MINOR))

    def _handle(self, received: Frame, now: float) -> None:
        try:
            message = plate_protocol.decode(received)
        except plate_protocol.LineError:
            message = None
        match message:
            case Telemetry():
                self._received_at = now
                self._has_answered = True
                self._follow(message, now)
            case HelloReply():
                self._received_at = now
                self._has_answered = True
                self.board = message
            case Beads():
                known = message.lag_ms != LAG_UNKNOWN_MS
                self.lag_s = message.lag_ms / 1000.0 if known else None
            case Ack():
                self._acknowledge(message)
            case _:
                self._counts["unknown_frames"] += 1

    def _follow(self, telemetry: Telemetry, now: float) -> None:
        if self._uptime_ms is not None and _went_back(self._uptime_ms, telemetry.uptime_ms):
            # The uptime went back, so the board was reset. Earlier commands are void, since the
            # lease on the board was lost with its memory. The dose of the skin is not void: the
            # board may count from zero now, so what it had reported is carried over here.
            self._dose.restart()
            if self.telemetry is not None:  # otherwise opening the port caused the reset
                self._restarted()
        if telemetry.faults:
            self._drive.block()
        self._watch_clock(telemetry, now)
        self._watch_following(telemetry, now)
        self._uptime_ms = telemetry.uptime_ms
        self.telemetry = telemetry
        self._dose.update(telemetry.dose_mcem43 / 1000.0, float(telemetry.heated_s), now)

    def _watch_clock(self, telemetry: Telemetry, now: float) -> None:
        """Switch the board off when its clock goes wrong: it would miscount leases and dose."""
        was_wrong = self._clock.is_wrong
        self._clock.note(telemetry.uptime_ms, now)
        if self._clock.is_wrong and not was_wrong:
            self._drive.block()
            self.off()

    def _watch_following(self, telemetry: Telemetry, now: float) -> None:
        """Detect a board that holds no temperature although setpoints keep being sent to it."""
        if telemetry.state == State.HOLDING:
            self._unfollowed_since = None
            self._is_unfollowed = False
        elif not self._drive.is_driving or telemetry.faults:
            self._unfollowed_since = None
        elif self._unfollowed_since is None:
            self._unfollowed_since = now
        elif now - self._unfollowed_since > TRACKING_TIMEOUT_S:
            # The board reports no fault and yet does not drive: noise on the line destroys the
            # setpoints, or a wire to the board is broken. The board cannot know that setpoints were
            # sent. The host does: it has sent them for longer than the slowest board takes to hold
            # one.
            self._is_unfollowed = True

    def _acknowledge(self, ack: Ack) -> None:
        self._orders.acknowledge(ack)
        self._counts["refused"] += ack.code != Answer.OK
        if ack.code == Answer.NEEDS_HELLO and self.board is not None:
            self._restarted()

    def _restarted(self) -> None:
        self._counts["board_resets"] += 1
        self._drive.block()
        self._forget()


@dataclass(slots=True)
class BoardClock:
    """Compares the rate of a board's clock with ours, from one reset of the board to the next.

    The board counts leases and dose with its own clock, so a clock that runs slow would heat a hand
    for longer than the host allowed.
    """

    is_wrong: bool = False
    _first: tuple[int, float] | None = None  # the first uptime in ms, and when it arrived
    _window_at: float = 0.0
    _min_delay_s: float = 0.0  # smallest delay in the current window
    _previous: tuple[float, float] | None = None  # end of the last window, its smallest delay
    _wrong_windows: int = 0

    def note(self, uptime_ms: int, now: float) -> None:
        """Compare an uptime in ms, which wraps at 2^32, with the time in s at which it arrived."""
        if self._first is None:
            self._first = (uptime_ms, now)
            self._window_at = now
            self._min_delay_s = 0.0
            return
        first_ms, begun = self._first
        delay_s = (now - begun) - ((uptime_ms - first_ms) % _UPTIME_WRAPS_MS) / 1000.0
        if now - self._window_at >= CLOCK_WINDOW_S:
            self._judge(now)
            self._window_at = now
            self._min_delay_s = delay_s
        self._min_delay_s = min(self._min_delay_s, delay_s)

    def _judge(self, now: float) -> None:
        previous = self._previous
        self._previous = (now, self._min_delay_s)
        if previous is None:
            return
        then, previous_delay_s = previous
        # The line, the operating system and this process delay each telemetry by a different time,
        # which is never negative. The smallest delay of a window is nearly free of that jitter. If
        # the board's clock runs at the right rate, the smallest delay stays the same from window to
        # window; if it runs fast or slow, the smallest delay moves by the same share of each
        # window.
        drift = abs(self._min_delay_s - previous_delay_s) / (now - then)
        self._wrong_windows = self._wrong_windows + 1 if drift > MAX_DRIFT else 0
        self.is_wrong = self._wrong_windows >= MAX_WRONG_WINDOWS


@dataclass(slots=True)
class Dose:
    """Adds up the thermal dose (CEM43, minutes) and the heated time (s) over resets of the board.

    The dose belongs to the skin, which does not forget when a board restarts (docs/physics.md 3.1).
    """

    _reported: tuple[float, float] = (0.0, 0.0)  # by the board since its last reset
    _carried: tuple[float, float] = (0.0, 0.0)  # from before that reset
    _rested_since: float | None = None
    _is_restarted: bool = False

    @property
    def total(self) -> tuple[float, float]:
        """Dose (CEM43, minutes) and heated time (s) of the whole session."""
        return self._reported[0] + self._carried[0], self._reported[1] + self._carried[1]

    def update(self, dose_cem43: float, heated_s: float, now: float) -> None:
        """Record the board's report; a rest of REST_S ends what is carried over from before."""
        # A reset by the watchdog leaves the board's dose in memory that survives a reset; after a
        # loss of supply the board counts from zero. The telemetry does not say which of the two
        # happened. So the dose from before the reset is added, unless the board's own count is at
        # least as high and therefore contains it already.
        is_remembered = dose_cem43 >= self._carried[0] and heated_s >= self._carried[1]
        if self._is_restarted and is_remembered:
            self._carried = (0.0, 0.0)
        self._is_restarted = False
        if heated_s > self._reported[1] or self._rested_since is None:
            self._rested_since = now
        elif now - self._rested_since >= REST_S:
            self._carried = (0.0, 0.0)
        self._reported = dose_cem43, heated_s

    def restart(self) -> None:
        """Carry over what was reported so far: the board was reset and may count from zero."""
        self._carried = self.total
        self._reported = (0.0, 0.0)
        self._is_restarted = True


def _celsius(milli: int | None) -> float | None:
    return None if milli is None else milli / 1000.0


def _went_back(before_ms: int, now_ms: int) -> bool:
    return (now_ms - before_ms) % _UPTIME_WRAPS_MS >= _UPTIME_WRAPS_MS // 2
