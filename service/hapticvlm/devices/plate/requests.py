"""Decides what the host sends to the board: setpoints with their lease, and orders. Pure.

A setpoint carries the time that is left of its lease (time to live) and needs no acknowledgement,
since it is renewed all the time. An order (rest, off, clear) is repeated until the board
acknowledges it or MAX_TRIES are used up.

After a lost port, a reset of the board or a fault the drive is blocked. Only a fresh command
unblocks it: one that follows a rest, or a pause in commanding of FRESH_AFTER_S. A caller that
merely continues drives nothing, because the touch it renews began before the fault.
"""

from __future__ import annotations

import math

from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.protocol import Ack, Answer, Message, Off, Rest
from hapticvlm.rendering.heat import limits as plate_limits

CHANGE_INTERVAL_S = 0.04  # at least, between setpoints that differ
RENEW_INTERVAL_S = 0.1  # between equal setpoints, to renew the lease
FRESH_AFTER_S = 0.5  # longer than the service's own lease, so such a pause means a release
ACK_TIMEOUT_S = 0.15  # before an order is sent again
MAX_TRIES = 5


class Orders:
    """Repeats the newest order until it is acknowledged, and numbers everything the host sends."""

    def __init__(self) -> None:
        self.answer: Answer | None = None  # to the newest order
        self.lost = 0  # orders that were never acknowledged
        self._seq = 0
        self._message: Message | None = None
        self._message_seq = self._tries = 0
        self._sent_at = -math.inf

    @property
    def is_waiting(self) -> bool:
        """Whether the newest order is not acknowledged yet."""
        return self._message is not None

    def encode(self, message: Message) -> bytes:
        """Encode a message with the next sequence number."""
        return plate_protocol.encode(message, self._next_seq())

    def put(self, message: Message) -> None:
        """Replace the current order by this one, unless it is a rest and an off is unanswered."""
        # Only the newest order waits for its acknowledgement, with one exception. A rest drives the
        # plate back to neutral, and the caller that ordered off may have seen that a sensor reads
        # wrong, so driving at all would be dangerous: an unanswered off outlives a later rest.
        if isinstance(message, Rest) and isinstance(self._message, Off):
            return
        self._message, self._message_seq = message, self._next_seq()
        self._tries = 0
        self._sent_at = -math.inf
        self.answer = None

    def drop(self) -> None:
        """Drop the current order."""
        self._message = None

    def drop_rest(self) -> None:
        """Drop an unanswered rest, since its repetition would undo a newer command."""
        if isinstance(self._message, Rest):
            self._message = None

    def due(self, now: float) -> bytes:
        """Return the frame to send now, or b""; an order that used up its tries counts as lost."""
        if self._message is None or now - self._sent_at < ACK_TIMEOUT_S:
            return b""
        if self._tries >= MAX_TRIES:
            self.lost += 1
            self._message = None
            return b""
        self._tries += 1
        self._sent_at = now
        return plate_protocol.encode(self._message, self._message_seq)

    def acknowledge(self, ack: Ack) -> None:
        """Record an acknowledgement; one of an older order changes nothing."""
        message = self._message
        if message is None or ack.of_seq != self._message_seq:
            return
        if ack.of_kind == plate_protocol.kind_of(message):
            self._message = None
            self.answer = ack.answer

    def _next_seq(self) -> int:
        self._seq = (self._seq + 1) % 256
        return self._seq


class Drive:
    """Holds one setpoint with its lease, and decides whether a command may drive the plate."""

    def __init__(self) -> None:
        self.ignored = 0  # commands that had no effect because the drive was blocked
        self._setpoint_mc: int | None = None
        self._sent_mc: int | None = None
        self._expires_at = self._sent_at = self._commanded_at = -math.inf
        self._is_blocked = False
        self.is_driving = False  # a setpoint was sent and its lease has not ended

    def command(self, setpoint_c: float, ttl_s: float, now: float, *, may_drive: bool) -> bool:
        """Accept a setpoint in degC, limited to the band, for `ttl_s`.

        Returns whether it takes effect: not while `may_drive` is false, nor for a caller that
        merely continues after that.
        """
        if not 0.0 < ttl_s < math.inf:
            return False
        # After a fault or a reset the plate must not resume by itself: the hand may have left, and
        # the cause may still be there. A renewal of the old touch looks like any other command, so
        # a new touch is recognised by the pause before it, which is longer than any lease. Commands
        # of a caller that never pauses are ignored and counted.
        is_renewal = abs(now - self._commanded_at) <= FRESH_AFTER_S
        self._commanded_at = now
        self._is_blocked = not may_drive or (self._is_blocked and is_renewal)
        if self._is_blocked:
            self.ignored += 1
            return False
        self._setpoint_mc = round(plate_limits.within_range(setpoint_c).setpoint_c * 1000.0)
        self._expires_at = now + ttl_s
        return True

    def rest(self) -> None:
        """End the lease; the next command counts as fresh."""
        self._release()
        self._commanded_at = -math.inf

    def block(self) -> None:
        """End the lease and ignore commands until a fresh one arrives."""
        self._release()
        self._is_blocked = True

    def is_due(self, now: float) -> bool:
        """Whether there is a setpoint to send now."""
        pause_s = RENEW_INTERVAL_S if self._setpoint_mc == self._sent_mc else CHANGE_INTERVAL_S
        return self._setpoint_mc is not None and now - self._sent_at >= pause_s

    def due(self, now: float) -> plate_protocol.Setpoint | None:
        """Return the setpoint to send now, or None; an expired lease ends here."""
        left_s = self._expires_at - now
        if self._setpoint_mc is None or left_s <= 0.0:
            self._release()
            return None
        if not self.is_due(now):
            return None
        self._sent_at = now
        self._sent_mc = self._setpoint_mc
        self.is_driving = True
        ttl_ms = min(max(round(left_s * 1000.0), 1), plate_protocol.MAX_TTL_MS)
        return plate_protocol.Setpoint(self._setpoint_mc, ttl_ms)

    def _release(self) -> None:
        self._setpoint_mc = self._sent_mc = None
        self.is_driving = False
        self._expires_at = self._sent_at = -math.inf
