"""The actions of a session: immutable values, carried out in order by the gateway."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from hapticvlm.messages import FeelForm, Frame, Scope, ServiceMessage
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.targets import ObjectTarget, RecognitionRequest


class Reply(msgspec.Struct, frozen=True, gc=False):
    """Send this to the session's own connection."""

    message: ServiceMessage


@dataclass(frozen=True, slots=True)
class AskAmbient:
    """Ask a VLM for the ambient temperature in this picture; `view` numbers what it shows."""

    picture: Frame
    view: int
    number: int = 0


@dataclass(frozen=True, slots=True)
class AskMaterial:
    """Ask a VLM what the object in this picture is made of; the last rung."""

    picture: Frame
    target: ObjectTarget
    generation: int
    number: int = 0


Ask = AskAmbient | AskMaterial


class PlayVibration(msgspec.Struct, frozen=True, gc=False):
    """Write this to the audio ring."""

    command: Command


class ReleaseHand(msgspec.Struct, frozen=True, gc=False):
    """Fade one hand's vibration (0 left, 1 right)."""

    hand: int


@dataclass(frozen=True, slots=True)
class SetGain:
    """Set the vibration gain (0..1)."""

    gain: float


@dataclass(frozen=True, slots=True)
class KeepThermalGain:
    """Keep the thermal gain (0..1) that was set, for the next owner of the outputs."""

    gain: float


@dataclass(frozen=True, slots=True)
class DrivePlate:
    """Drive the plate to `setpoint_c` for at most `ttl_s`."""

    setpoint_c: float
    ttl_s: float


@dataclass(frozen=True, slots=True)
class RestPlate:
    """Return the plate to neutral."""


@dataclass(frozen=True, slots=True)
class HoldOutputs:
    """Rest the outputs of this scope at once and hold them there."""

    scope: Scope


@dataclass(frozen=True, slots=True)
class SendVibration:
    """Send `vibration` events for the left and the right hand, in these forms; None = none."""

    forms: tuple[FeelForm | None, FeelForm | None]


@dataclass(frozen=True, slots=True)
class Watch:
    """Send this observer views of these kinds."""

    kinds: frozenset[str]


Action = (
    Reply
    | RecognitionRequest
    | Ask
    | PlayVibration
    | ReleaseHand
    | SetGain
    | KeepThermalGain
    | DrivePlate
    | RestPlate
    | HoldOutputs
    | SendVibration
    | Watch
)
