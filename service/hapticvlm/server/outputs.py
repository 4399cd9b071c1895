"""Drives speaker, plate and what is worn, and knows which of them a stop holds."""

from __future__ import annotations

import time
from collections.abc import Sequence

from hapticvlm.devices.plate.plate import Plate
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.devices.worn.output import WornOutput
from hapticvlm.messages import Scope
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.session.actions import (
    DrivePlate,
    KeepThermalGain,
    PlayVibration,
    ReleaseHand,
    RestPlate,
    SetGain,
)
from hapticvlm.session.hands import Hold

OutputAction = PlayVibration | ReleaseHand | SetGain | KeepThermalGain | DrivePlate | RestPlate


class Outputs:
    """Speaker and plate together, and what is worn; after `close` none is driven."""

    def __init__(self, speaker: Speaker, plate: Plate, worn: Sequence[WornOutput] = ()) -> None:
        self.speaker = speaker
        self.plate = plate
        self.worn = worn
        self.hold = Hold()
        self.reading: PlateReading = plate.advance(time.monotonic())
        self.is_closed = False
        self.thermal_gain = 1.0  # as was set last, for the next owner

    def close(self) -> None:
        """Rest both at once, with the plate's bridge open, and drive nothing from now on."""
        # From here on nothing drives anything: between this and the end of the process a session
        # may still tick, and a touch on its way may arrive. The engine fades within 20 ms; the
        # board opens its bridge and needs nobody, should this process end before the line is
        # served.
        self.is_closed = True
        self._rest_worn("all")
        self.speaker.rest()
        self.plate.off(time.monotonic())

    @property
    def faults(self) -> list[str]:
        """Names of the current faults of all outputs."""
        worn = (fault for output in self.worn for fault in output.faults)
        return [*self.reading.faults, *self.speaker.faults, *worn]

    def _rest_worn(self, scope: Scope) -> None:
        for output in self.worn:
            if scope != "peltier":
                output.rest_vibration()
            if scope != "speaker":
                output.rest_heat()

    def rest(self) -> None:
        """Rest all: the vibration at once, the plate by a slow return to neutral."""
        self._rest_worn("all")
        self.speaker.rest()
        self.plate.rest(time.monotonic())

    def stop(self, scope: Scope) -> None:
        """Rest those of this scope at once and hold them there; the plate's bridge opens.

        The person who stops may have noticed a wrong sensor: driving to neutral could heat then.
        """
        self.hold.stop(scope)
        self._rest_worn(scope)
        if scope != "peltier":
            self.speaker.rest()
        if scope != "speaker":
            self.plate.off(time.monotonic())

    def follow(self, now: float) -> list[str]:
        """Update from the plate's reading; return the faults that are new."""
        before = self.reading.faults
        self.reading = self.plate.advance(now)
        return [fault for fault in self.reading.faults if fault not in before]

    def drive(self, action: OutputAction) -> None:
        """Carry out an action of a session."""
        if self.is_closed:
            return
        vibrating: tuple[Speaker | WornOutput, ...] = (self.speaker, *self.worn)
        for output in vibrating:
            _vibrate(output, action)
        match action:
            # The gain of heat belongs to the session, which scales its own setpoints. It is kept
            # here for the next owner of the outputs, as the speaker keeps that of vibration: it was
            # turned down for the person, and not for one scene.
            case KeepThermalGain():
                self.thermal_gain = action.gain
            case DrivePlate():
                self.plate.command(action.setpoint_c, action.ttl_s, time.monotonic())
                for worn in self.worn:
                    worn.warm(action.setpoint_c, action.ttl_s)
            case RestPlate():
                self.plate.rest(time.monotonic())
                self._rest_worn("peltier")


def _vibrate(output: Speaker | WornOutput, action: OutputAction) -> None:
    match action:
        case PlayVibration():
            output.play(action.command)
        case ReleaseHand():
            output.release(action.hand)
        case SetGain():
            output.set_gain(action.gain)
