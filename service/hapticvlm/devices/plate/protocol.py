"""Encodes and decodes the messages between host and plate, one frame each. Pure.

The messages are those of `firmware/PROTOCOL.md`; a test compares the numbers with the firmware's
own header. Integers are little endian. This module knows no port, clock or plate.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, Self

from hapticvlm.devices.plate.framing import Frame, frame
from hapticvlm.errors import HapticVLMError

MAJOR = 1
MINOR = 3
BAUD = 250_000  # exact on a 16 MHz ATmega328P
MAX_TTL_MS = 1000
NO_READING = -(2**31)  # on the wire; None in a Telemetry
MAX_LAG_MS = 1000
LAG_UNKNOWN_MS = 0xFFFF  # on the wire: the board was never told the lag of its beads
ONE_RESISTOR_MA = 720  # full scale of the firmware for the plate of one resistor
FOR_ONE_RESISTOR = " for one resistor"  # after its version
LIMITED_BY_CURRENT = 1 << 2  # bit in `Telemetry.limited`


class Answer(IntEnum):
    """Result of a request, as an ACK reports it."""

    OK = 0
    UNKNOWN = 1
    LENGTH = 2
    VERSION = 3
    NEEDS_HELLO = 4
    RANGE = 5
    TTL = 6
    FAULTED = 7
    PERSISTS = 8
    NOT_LATCHED = 9
    LOCKED = 10
    DRIVING = 11


class State(IntEnum):
    """Activity of the board: off, holding a setpoint, returning to neutral, or faulted."""

    OFF = 0
    HOLDING = 1
    RETURNING = 2
    FAULTED = 3


class LineError(HapticVLMError):
    """A frame passed its CRC but is not a message of this protocol."""


@dataclass(frozen=True, slots=True)
class Hello:
    """Host: start a session with this protocol version."""

    major: int
    minor: int


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Host: hold this temperature (milli-degC) for this long (ms)."""

    setpoint_mc: int
    ttl_ms: int


@dataclass(frozen=True, slots=True)
class Off:
    """Host: open the bridge at once."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Host: slew to neutral, then off."""


@dataclass(frozen=True, slots=True)
class Clear:
    """Host: unlatch one fault, by its number."""

    fault: int


@dataclass(frozen=True, slots=True)
class Lag:
    """Host: keep this lag of the plate's thermistors (ms) for good; refused while driving."""

    lag_ms: int


@dataclass(frozen=True, slots=True)
class Beads:
    """Board, after its HELLO_REPLY: the lag of its thermistors (ms), or LAG_UNKNOWN_MS."""

    lag_ms: int


@dataclass(frozen=True, slots=True)
class HelloReply:
    """Board: its versions, identity and limits; units are in the names (mc: milli-degC)."""

    major: int
    minor: int
    firmware_major: int
    firmware_minor: int
    firmware_patch: int
    board_id: int
    setpoint_low_mc: int
    setpoint_high_mc: int
    slew_mc_s: int
    max_ttl_ms: int
    heat_limit_ma: int
    cool_limit_ma: int
    heat_cap: int
    cool_cap: int
    telemetry_hz: int
    reset_cause: int

    @property
    def firmware(self) -> str:
        """Version of the firmware, and whether it is for the plate of one resistor."""
        version = f"{self.firmware_major}.{self.firmware_minor}.{self.firmware_patch}"
        return version + FOR_ONE_RESISTOR * (self.cool_limit_ma == ONE_RESISTOR_MA)

    @property
    def refusal(self) -> str | None:
        """Reason why this board cannot be used, with what to do; None if it can."""
        if self.major == MAJOR:
            return None
        remedy = "flash the firmware of this release" if self.major < MAJOR else "upgrade it"
        return (
            f"the board speaks plate protocol {self.major}.{self.minor}, this hapticvlm "
            f"{MAJOR}.{MINOR}: {remedy}"
        )

    def drive(self, duty: int) -> tuple[float, float]:
        """Convert a duty to the share of full drive, -1 (cool) to 1 (heat), and the current, A."""
        cap = self.cool_cap
        limit_ma = self.cool_limit_ma
        if duty > 0:
            cap = self.heat_cap
            limit_ma = self.heat_limit_ma
        share = min(max(duty / cap, -1.0), 1.0) if cap else 0.0
        return share, share * limit_ma / 1000.0


@dataclass(frozen=True, slots=True)
class Telemetry:
    """Board: its state, 20 times a second; None means no reading. Units are those of the wire."""

    uptime_ms: int
    state: int
    faults: int
    plate_mc: int | None
    plate2_mc: int | None
    sink_mc: int | None
    setpoint_mc: int | None
    duty: int
    limited: int
    bad_frames: int
    refused: int
    dose_mcem43: int
    heated_s: int
    reset_cause: int

    @classmethod
    def read(cls, values: Iterable[int]) -> Self:
        """Build it from the integers of its payload, in order."""
        names = [field.name for field in fields(cls)]
        arguments: dict[str, Any] = dict(zip(names, values, strict=True))
        for name in _READINGS:
            arguments[name] = None if arguments[name] == NO_READING else arguments[name]
        return cls(**arguments)


@dataclass(frozen=True, slots=True)
class Ack:
    """Board: the result of one frame of the host, identified by its type and seq."""

    of_kind: int
    of_seq: int
    code: int

    @property
    def answer(self) -> Answer:
        """The code as an Answer; a code of a newer firmware counts as UNKNOWN."""
        return Answer(self.code) if self.code <= max(Answer) else Answer.UNKNOWN


Message = Hello | Setpoint | Off | Rest | Clear | Lag | HelloReply | Telemetry | Ack | Beads

_READINGS = ("plate_mc", "plate2_mc", "sink_mc", "setpoint_mc")
_LAYOUTS: dict[int, tuple[type[Message], struct.Struct]] = {
    0x01: (Hello, struct.Struct("<BB")),
    0x02: (Setpoint, struct.Struct("<iH")),
    0x03: (Off, struct.Struct("<")),
    0x04: (Rest, struct.Struct("<")),
    0x05: (Clear, struct.Struct("<B")),
    0x06: (Lag, struct.Struct("<H")),
    0x81: (HelloReply, struct.Struct("<BBBBBIiiHHHHHHBB")),
    0x82: (Telemetry, struct.Struct("<IBIiiiihBHHHHB")),
    0x83: (Ack, struct.Struct("<BBB")),
    0x84: (Beads, struct.Struct("<H")),
}
_KINDS = {message: kind for kind, (message, _) in _LAYOUTS.items()}


def kind_of(message: Message) -> int:
    """Return the type byte of a message."""
    return _KINDS[type(message)]


def encode(message: Message, seq: int) -> bytes:
    """Encode a message as one frame between two zeros; `seq` counts modulo 256."""
    kind = kind_of(message)
    values = (getattr(message, field.name) for field in fields(message))
    numbers = [NO_READING if value is None else value for value in values]
    return frame(Frame(kind, seq % 256, _LAYOUTS[kind][1].pack(*numbers)))


def decode(received: Frame) -> Message:
    """Decode the message in a frame. Raises LineError for an unknown type or a wrong size."""
    if received.kind not in _LAYOUTS:
        raise LineError(f"unknown message type {received.kind:#04x}")
    message, layout = _LAYOUTS[received.kind]
    if len(received.payload) != layout.size:
        raise LineError(
            f"{message.__name__} has {len(received.payload)} bytes; it must have {layout.size}"
        )
    values = layout.unpack(received.payload)
    return Telemetry.read(values) if message is Telemetry else message(*values)
