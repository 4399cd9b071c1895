"""What the service needs of any plate."""

from __future__ import annotations

from typing import Protocol

from hapticvlm.rendering.heat.limits import PlateReading


class Plate(Protocol):
    """One Peltier plate. `now` is in seconds of one clock; the caller advances it at about 50 Hz.

    A plate holds a temperature only while commands with a time to live keep coming: neutral too is
    held only when commanded. Without one it returns to neutral by itself, then switches off.
    """

    simulated: bool
    name: str

    @property
    def counts(self) -> dict[str, int]:
        """What did not go as it should, by name."""

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` for `ttl_s`; a later command replaces this one."""

    def rest(self, now: float) -> None:
        """Return to neutral, then switch off, whatever was commanded."""

    def off(self, now: float) -> None:
        """Open the bridge at once, without a return to neutral."""

    def advance(self, now: float) -> PlateReading:
        """Advance to `now` and read the plate."""

    def close(self) -> None:
        """Switch off and close the device."""
