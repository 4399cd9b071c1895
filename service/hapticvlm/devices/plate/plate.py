"""Declares the interface that every plate has, real or simulated."""

from __future__ import annotations

from typing import Protocol

from hapticvlm.rendering.heat.limits import PlateReading


class Plate(Protocol):
    """One Peltier plate. `now` is in s of one clock; the caller calls `advance` at about 50 Hz.

    Every command is a lease: the plate holds the temperature only while commands with a time to
    live keep coming, and that includes neutral. When the lease ends the plate returns to neutral by
    itself, then switches off.
    """

    simulated: bool
    name: str

    @property
    def counts(self) -> dict[str, int]:
        """Number of each kind of irregularity so far, by name."""

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c` (degC) for `ttl_s`; a later command replaces this one."""

    def rest(self, now: float) -> None:
        """End the lease: return to neutral, then switch off."""

    def off(self, now: float) -> None:
        """Open the bridge at once, without a return to neutral."""

    def advance(self, now: float) -> PlateReading:
        """Advance to `now` and return the plate's reading."""

    def close(self) -> None:
        """Switch off and close the device."""
