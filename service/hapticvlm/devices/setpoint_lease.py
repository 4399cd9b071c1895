"""The setpoint in force: when it is sent, with what time to live, and who may command one. Pure.

After a loss, a reset of the board or a fault the drive is held: only a fresh command takes effect,
one that follows a rest or a pause in commanding. A caller that just goes on drives nothing.
"""

from __future__ import annotations

import math

from hapticvlm.devices import plate_protocol
from hapticvlm.rendering import plate_limits

CHANGE_S, RENEW_S = 0.04, 0.1  # a changed setpoint is sent at most, the same one at least as often
PAUSE_S = 0.5  # longer than the service's own lease: a caller that paused this long has released it


class Drive:
    """One setpoint with its lease."""

    def __init__(self) -> None:
        self.ignored = 0
        self._setpoint_mc: int | None = None
        self._sent_mc: int | None = None
        self._until = self._sent_at = self._commanded_at = -math.inf
        self._is_held = False
        self.is_driving = False  # a setpoint was sent and its lease has not ended

    def command(self, setpoint_c: float, ttl_s: float, now: float, *, may_drive: bool) -> bool:
        """Accept a setpoint, limited to the band, for `ttl_s`; return whether it takes effect."""
        if not 0.0 < ttl_s < math.inf:
            return False
        goes_on = abs(now - self._commanded_at) <= PAUSE_S
        self._commanded_at = now
        self._is_held = not may_drive or (self._is_held and goes_on)
        if self._is_held:
            self.ignored += 1
            return False
        self._setpoint_mc = round(plate_limits.within_range(setpoint_c).setpoint_c * 1000.0)
        self._until = now + ttl_s
        return True

    def rest(self) -> None:
        """End the lease; the next command is a fresh one."""
        self._release()
        self._commanded_at = -math.inf

    def hold(self) -> None:
        """End the lease; a caller that goes on commanding drives nothing."""
        self._release()
        self._is_held = True

    def due(self, now: float) -> plate_protocol.Setpoint | None:
        """Return the setpoint to send now, if any; a lease that has run out ends here."""
        left_s = self._until - now
        if self._setpoint_mc is None or left_s <= 0.0:
            self._release()
            return None
        pause_s = RENEW_S if self._setpoint_mc == self._sent_mc else CHANGE_S
        if now - self._sent_at < pause_s:
            return None
        self._sent_at, self._sent_mc = now, self._setpoint_mc
        self.is_driving = True
        ttl_ms = min(max(round(left_s * 1000.0), 1), plate_protocol.MAX_TTL_MS)
        return plate_protocol.Setpoint(self._setpoint_mc, ttl_ms)

    def _release(self) -> None:
        self._setpoint_mc = self._sent_mc = None
        self.is_driving = False
        self._until = self._sent_at = -math.inf
