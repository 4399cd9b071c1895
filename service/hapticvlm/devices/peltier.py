"""What every plate offers, simulated or on a wire. Knows no model of heat, nor a port yet."""

from __future__ import annotations

from typing import Protocol

from hapticvlm.rendering.thermal import PlateReading


class DeviceError(Exception):
    """The hardware failed or is not there; outputs rest and the scene is told."""


class Plate(Protocol):
    """One Peltier plate. `now` is in seconds of one clock; the caller advances it at about 50 Hz.

    A plate holds a temperature only while commands with a time to live keep coming: neutral too is
    held only when commanded. Without one it returns to neutral by itself, then switches off.
    """

    simulated: bool
    name: str

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` for `ttl_s`; a later command replaces this one."""

    def rest(self, now: float) -> None:
        """Return to neutral, then switch off, whatever was commanded."""

    def advance(self, now: float) -> PlateReading:
        """Let time pass up to `now` and read the plate."""

    def close(self) -> None:
        """Switch off and let go of the device."""
