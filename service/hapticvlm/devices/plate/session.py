"""The host's half of the plate's protocol: bytes and `now` in, bytes and readings out. Sans-I/O.

The owner of the port calls `opened`, `receive` and `lost`, and writes what `outgoing` returns, many
times a second. Nothing is driven before the board has answered a HELLO of our major version. A
setpoint is sent with what is left of its lease and never after it. After a loss, a reset of the
board or a fault nothing is driven until a fresh command arrives (`requests.py`). Bytes that do not
fit the protocol are counted; no input raises an error.

Two more things are watched here because the board cannot: whether its clock runs at the right rate
(`BoardClock`), and the dose over resets of a board that forgets it (`Dose`).
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from hapticvlm.devices import faults
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer, Frame
from hapticvlm.devices.plate.protocol import Ack, Answer, HelloReply, Message, State, Telemetry
from hapticvlm.devices.plate.requests import Drive, Orders
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import PlateReading

CLOCK_WINDOW_S = 10.0
MAX_DRIFT = 0.05  # ceramic resonators are within 0.5 %; our choice
MAX_WRONG_WINDOWS = 2
_UPTIME_WRAPS_MS = 2**32
REST_S = 900.0  # without heat until a new session's heat may begin: our choice, as long as one
HELLO_S = 0.25  # between HELLOs; a boot loader eats the first ones
RX_TIMEOUT_S = 0.5  # ten telemetries missed while listening
POLL_TIMEOUT_S = 2.0  # without listening: whoever reads the port is stuck
TRACKING_TIMEOUT_S = 0.8  # of setpoints that the board does not follow: a fault within a second
REOPEN_AFTER_S = 3.0  # longer than a boot loader: then the port is worth opening again
_UPTIME_WRAPS = 2**32


@dataclass(slots=True)
class BoardClock:
    """What one board's uptime says, from a reset on."""

    is_wrong: bool = False
    _first: tuple[int, float] | None = None
    _window_at: float = 0.0
    _min_delay_s: float = 0.0
    _previous: tuple[float, float] | None = None  # middle of the last window, its least delay
    _wrong_windows: int = 0

    def note(self, uptime_ms: int, now: float) -> None:
        """Receive an uptime that arrived at `now`."""
        if self._first is None:
            self._first = (uptime_ms, now)
            self._window_at = now
            self._min_delay_s = 0.0
            return
        first_ms, begun = self._first
        late_s = (now - begun) - ((uptime_ms - first_ms) % _UPTIME_WRAPS_MS) / 1000.0
        if now - self._window_at >= CLOCK_WINDOW_S:
            self._judge(now)
            self._window_at = now
            self._min_delay_s = late_s
        self._min_delay_s = min(self._min_delay_s, late_s)

    def _judge(self, now: float) -> None:
        before = self._previous
        self._previous = (now, self._min_delay_s)
        if before is None:
            return
        then, was_late_s = before
        # Lateness is what the line, the operating system and this process add: it is never negative
        # and changes from one telemetry to the next. The least of a window is nearly free of it. A
        # clock that runs at the right rate keeps that least value, one that runs wrong moves it by
        # the same share in every window.
        drift = abs(self._min_delay_s - was_late_s) / (now - then)
        self._wrong_windows = self._wrong_windows + 1 if drift > MAX_DRIFT else 0
        self.is_wrong = self._wrong_windows >= MAX_WRONG_WINDOWS


@dataclass(slots=True)
class Dose:
    """Thermal dose in CEM43 minutes and heat in seconds, as the board reports them and before."""

    _reported: tuple[float, float] = (0.0, 0.0)
    _carried: tuple[float, float] = (0.0, 0.0)
    _rested_since: float | None = None
    _is_restarted: bool = False

    @property
    def total(self) -> tuple[float, float]:
        """Dose and heat of the whole session."""
        return self._reported[0] + self._carried[0], self._reported[1] + self._carried[1]

    def update(self, dose_cem43: float, heated_s: float, now: float) -> None:
        """Update from the board's report; the report of its earlier run is dropped after a rest."""
        # A board that was reset by its watchdog keeps its dose in memory that survives, one that
        # lost its supply counts from zero. Both report one number. So after a reset what was known
        # before is added, unless the board's own count already contains it.
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
        """Keep what was reported so far: the board was reset and may count from zero."""
        self._carried = self.total
        self._reported = (0.0, 0.0)
        self._is_restarted = True


class PlateSession:
    """One plate over any number of ports and resets. Not thread-safe."""

    def __init__(self) -> None:
        self.board: HelloReply | None = None
        self.telemetry: Telemetry | None = None
        self._counts: Counter[str] = Counter()
        self._deframer = Deframer()
        self._dose = Dose()
        self._drive = Drive()
        self._orders = Orders()
        self._is_open = self._was_open = False
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
        """Why this board can't be used, if it can't."""
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
        """The board's answer to the newest order; None if there is none (yet)."""
        return self._orders.answer

    @property
    def counts(self) -> dict[str, int]:
        """Everything that did not fit, here and on the board."""
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
        """Begin on a port that was just opened; the board may be resetting (DTR)."""
        if self._was_open:
            self._counts["reconnects"] += 1
            self._drive.hold()
        self._is_open = self._was_open = True
        self._counts["bad_frames"] += self._deframer.bad
        self._deframer = Deframer()
        self._received_at = self._polled_at = now
        self._forget()

    def lost(self) -> None:
        """Forget the port and what was commanded."""
        if self._is_open:
            self._counts["losses"] += 1
            self._drive.hold()
        self._is_open = False
        self._forget()

    def ended(self) -> None:
        """Report nothing more of a port that was closed on purpose."""
        self._was_open = False

    def is_gone(self, now: float) -> bool:
        """Return whether an open port has been useless for so long that it is worth closing."""
        return self._is_open and now - self._received_at > REOPEN_AFTER_S

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> bool:
        """Hold `setpoint_c`, limited to the band, for `ttl_s`, if this is a fresh command.

        Returns whether there is something to send at once.
        """
        is_sound = not (self.telemetry and self.telemetry.faults) and not self._clock.is_wrong
        may_drive = self.is_ready and is_sound
        if not self._drive.command(setpoint_c, ttl_s, now, may_drive=may_drive):
            return False
        self._orders.drop_rest()
        return self._drive.is_due(now)

    def rest(self) -> None:
        """Return to neutral, then off."""
        self._order(plate_protocol.Rest())

    def off(self) -> None:
        """Switch the bridge off at once."""
        self._order(plate_protocol.Off())

    def clear(self, fault: int) -> None:
        """Ask the board to unlatch one fault; `answer` is its reply."""
        self._order(plate_protocol.Clear(fault))

    def receive(self, data: bytes, now: float) -> None:
        """Receive the bytes that came from the port, which may be none."""
        self._polled_at = now
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
        """Return the plate's last reading, with nothing measured when that is too long ago."""
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
        )

    def _is_fresh(self, now: float) -> bool:
        """Return whether telemetry is recent, counted only while the port was read."""
        is_recent = self._polled_at - self._received_at <= RX_TIMEOUT_S
        return self._is_open and is_recent and now - self._polled_at <= POLL_TIMEOUT_S

    def _faults(self, now: float) -> tuple[str, ...]:
        found = () if self.telemetry is None else faults.names(self.telemetry.faults)
        if not self._was_open:
            return found
        if not self._is_open:
            return (*found, faults.UNPLUGGED.name)
        if self.refusal is not None:
            return (*found, faults.VERSION.name)
        if self._clock.is_wrong:
            found = (*found, faults.CLOCK_WRONG.name)
        if self._is_unfollowed:
            found = (*found, faults.NOT_FOLLOWED.name)
        return found if self._is_fresh(now) else (*found, faults.SILENT.name)

    def _order(self, message: Message) -> None:
        self._drive.rest()
        if self._is_open:
            self._orders.put(message)

    def _forget(self) -> None:
        self.board = self.telemetry = None
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
                self._follow(message, now)
            case HelloReply():
                self._received_at = now
                self.board = message
            case Ack():
                self._acknowledge(message)
            case _:
                self._counts["unknown_frames"] += 1

    def _follow(self, telemetry: Telemetry, now: float) -> None:
        if self._uptime_ms is not None and _went_back(self._uptime_ms, telemetry.uptime_ms):
            # An uptime that went back is a reset. What was commanded before is void, the lease on
            # the board has ended with its memory. The dose of the skin has not: the board may count
            # from zero, so what it had reported is carried over here.
            self._dose.restart()
            if self.telemetry is not None:  # else the port was just opened: expected
                self._restarted()
        if telemetry.faults:
            self._drive.hold()
        self._watch_clock(telemetry, now)
        self._watch_following(telemetry, now)
        self._uptime_ms = telemetry.uptime_ms
        self.telemetry = telemetry
        self._dose.update(telemetry.dose_mcem43 / 1000.0, float(telemetry.heated_s), now)

    def _watch_clock(self, telemetry: Telemetry, now: float) -> None:
        """Switch the board off when its clock goes wrong: it would count leases and dose wrong."""
        was_wrong = self._clock.is_wrong
        self._clock.note(telemetry.uptime_ms, now)
        if self._clock.is_wrong and not was_wrong:
            self._drive.hold()
            self.off()

    def _watch_following(self, telemetry: Telemetry, now: float) -> None:
        """Find that the board does not hold although it was sent setpoints all the time."""
        if telemetry.state == State.HOLDING:
            self._unfollowed_since = None
            self._is_unfollowed = False
        elif not self._drive.is_driving or telemetry.faults:
            self._unfollowed_since = None
        elif self._unfollowed_since is None:
            self._unfollowed_since = now
        elif now - self._unfollowed_since > TRACKING_TIMEOUT_S:
            # The board acknowledged nothing wrong, and yet does not drive: its supply is off, its
            # cut-out open, or the module came loose. It cannot know, the host can: setpoints went
            # out for longer than the slowest board takes to hold one.
            self._is_unfollowed = True

    def _acknowledge(self, ack: Ack) -> None:
        self._orders.acknowledge(ack)
        self._counts["refused"] += ack.code != Answer.OK
        if ack.code == Answer.NEEDS_HELLO and self.board is not None:
            self._restarted()

    def _restarted(self) -> None:
        self._counts["board_resets"] += 1
        self._drive.hold()
        self._forget()


def _celsius(milli: int | None) -> float | None:
    return None if milli is None else milli / 1000.0


def _went_back(before_ms: int, now_ms: int) -> bool:
    return (now_ms - before_ms) % _UPTIME_WRAPS >= _UPTIME_WRAPS // 2
