"""Frames with any content, also what the service never sends, and what the board says.

They are framed and read by the service's own modules, whose numbers are compared with those of the
firmware's header by tests/devices/test_plate_protocol.py.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from hapticvlm.devices import faults
from hapticvlm.devices.plate import framing, protocol

HELLO, SETPOINT, OFF, REST, CLEAR = 1, 2, 3, 4, 5
HELLO_REPLY, TELEMETRY, ACK = 0x81, 0x82, 0x83
FAULTS = {fault.name.upper(): number for number, fault in faults.FIRMWARE.items()}


@dataclass(frozen=True)
class Telemetry:
    """What the board says of itself, with the names of the firmware's header."""

    state: str
    faults: tuple[str, ...]
    setpoint_c: float | None
    bad_frames: int
    refused: int
    dose_cem43: float
    heated_s: int


def frame(type: int, seq: int, payload: bytes = b"") -> bytes:
    """Return the bytes of one message, without the zero that may stand before it."""
    return framing.frame(framing.Frame(type, seq, payload)).removeprefix(b"\0")


def setpoint(setpoint_c: float, ttl_s: float = 0.25) -> bytes:
    """Return the payload of SETPOINT."""
    return struct.pack("<iH", round(setpoint_c * 1000), round(ttl_s * 1000))


def said(received: framing.Frame) -> Telemetry | tuple[int, int, str] | None:
    """Return telemetry, the answer to a message as (type, seq, answer), or None for the others."""
    match protocol.decode(received):
        case protocol.Telemetry() as told:
            mc = told.setpoint_mc
            return Telemetry(
                protocol.State(told.state).name.lower(),
                tuple(name.upper() for name in faults.names(told.faults)),
                None if mc is None else mc / 1000.0,
                told.bad_frames,
                told.refused,
                told.dose_mcem43 / 1000.0,
                told.heated_s,
            )
        case protocol.Ack() as ack:
            return ack.of_kind, ack.of_seq, ack.answer.name.lower()
    return None
