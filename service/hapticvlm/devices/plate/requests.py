"""What the host asks of the board: a setpoint with its lease, and orders that must arrive. Pure.

A setpoint is sent with what is left of its time to live. After a loss, a reset of the board or a
fault the drive is held: only a fresh command takes effect, one that follows a rest or a pause in
commanding. A caller that just goes on drives nothing. Orders (rest, off, clear) are sent again
until the board acknowledges.
"""

from __future__ import annotations

import math

from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.protocol import Ack, Answer, Message, Off, Rest
from hapticvlm.rendering.heat import limits as plate_limits

# a changed setpoint is sent at most, the same one at least as often
CHANGE_INTERVAL_S = 0.04
RENEW_INTERVAL_S = 0.1
FRESH_AFTER_S = (
    0.5  # longer than the service's own lease: a caller that paused this long has released it
)
ACK_TIMEOUT_S = 0.15
MAX_TRIES = 5


class Orders:
    """The newest order, and the sequence number of everything the host sends."""

    def __init__(self) -> None:
        self.answer: Answer | None = None  # to the newest order
        self.lost = 0
        self._seq = 0
        self._message: Message | None = None
        self._message_seq = self._tries = 0
        self._sent_at = -math.inf

    @property
    def is_waiting(self) -> bool:
        """Whether the newest order is not answered yet."""
        return self._message is not None

    def encode(self, message: Message) -> bytes:
        """Write a message under the next sequence number."""
        return plate_protocol.encode(message, self._next_seq())

    def put(self, message: Message) -> None:
        """Order something; it replaces an older order, but no rest replaces an unanswered off."""
        # One order waits for its acknowledgement, the newest. But a rest drives the plate to
        # neutral, and who ordered off may have seen that its sensor lies: that order outlives a
        # later rest.
        if isinstance(message, Rest) and isinstance(self._message, Off):
            return
        self._message, self._message_seq = message, self._next_seq()
        self._tries = 0
        self._sent_at = -math.inf
        self.answer = None

    def drop(self) -> None:
        """Forget the order."""
        self._message = None

    def drop_rest(self) -> None:
        """Forget an unanswered rest: a newer command must not be undone by its repetition."""
        if isinstance(self._message, Rest):
            self._message = None

    def due(self, now: float) -> bytes:
        """Return the order to send now, or nothing; one that never arrives is counted in `lost`."""
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
        """Receive an acknowledgement; one of another order changes nothing."""
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
    """One setpoint with its lease."""

    def __init__(self) -> None:
        self.ignored = 0
        self._setpoint_mc: int | None = None
        self._sent_mc: int | None = None
        self._expires_at = self._sent_at = self._commanded_at = -math.inf
        self._is_blocked = False
        self.is_driving = False  # a setpoint was sent and its lease has not ended

    def command(self, setpoint_c: float, ttl_s: float, now: float, *, may_drive: bool) -> bool:
        """Accept a setpoint, limited to the band, for `ttl_s`; return whether it takes effect."""
        if not 0.0 < ttl_s < math.inf:
            return False
        # After a fault or a reset the plate must not go on by itself: the hand may have left, the
        # cause may be there still. A touch that is still renewed looks like any other command, so
        # what tells a new one is a pause, longer than any lease. A caller that never pauses is
        # ignored and counted.
        goes_on = abs(now - self._commanded_at) <= FRESH_AFTER_S
        self._commanded_at = now
        self._is_blocked = not may_drive or (self._is_blocked and goes_on)
        if self._is_blocked:
            self.ignored += 1
            return False
        self._setpoint_mc = round(plate_limits.within_range(setpoint_c).setpoint_c * 1000.0)
        self._expires_at = now + ttl_s
        return True

    def rest(self) -> None:
        """End the lease; the next command is a fresh one."""
        self._release()
        self._commanded_at = -math.inf

    def hold(self) -> None:
        """End the lease; a caller that goes on commanding drives nothing."""
        self._release()
        self._is_blocked = True

    def is_due(self, now: float) -> bool:
        """Whether there is a setpoint to send now."""
        pause_s = RENEW_INTERVAL_S if self._setpoint_mc == self._sent_mc else CHANGE_INTERVAL_S
        return self._setpoint_mc is not None and now - self._sent_at >= pause_s

    def due(self, now: float) -> plate_protocol.Setpoint | None:
        """Return the setpoint to send now, if any; a lease that has run out ends here."""
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
