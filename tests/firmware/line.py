"""A second implementation of the serial protocol, for bytes that the service never sends."""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

HELLO, SETPOINT, OFF, REST, CLEAR = 1, 2, 3, 4, 5
HELLO_REPLY, TELEMETRY, ACK = 0x81, 0x82, 0x83
NO_READING = -(2**31)
STATES = ("off", "holding", "returning", "faulted")
ANSWERS = (
    "ok",
    "unknown",
    "length",
    "version",
    "hello",
    "range",
    "ttl",
    "faulted",
    "persists",
    "not_latched",
    "locked",
)
FAULTS = (
    "-",
    "PLATE_A_OPEN",
    "PLATE_A_SHORT",
    "PLATE_B_OPEN",
    "PLATE_B_SHORT",
    "SINK_OPEN",
    "SINK_SHORT",
    "PLATE_DISAGREES",
    "PLATE_FROZEN",
    "READING_JUMPS",
    "OVER_TEMPERATURE",
    "UNDER_TEMPERATURE",
    "SINK_HOT",
    "RUNAWAY",
    "WIRED_BACKWARDS",
    "COOLING_REVERSED",
    "DOSE_SPENT",
    "WATCHDOG",
    "BROWN_OUT",
    "RESTARTED_DRIVING",
    "SINK_IMPLAUSIBLE",
    "CUT_OUT_OPEN",
    "CUT_OUT_UNTESTED",
    "CUT_OUT_BEAD",
    "PLATE_A_STRAYS",
    "PLATE_B_STRAYS",
)  # by number
LIMITS = {2: "slew", 4: "current", 8: "sink", 16: "dose"}
_TELEMETRY = struct.Struct("<IBIiiiihBHHHHB")


@dataclass(frozen=True)
class Telemetry:
    """One telemetry message; None is a missing reading."""

    uptime_s: float
    state: str
    faults: tuple[str, ...]
    plate_c: float | None
    plate2_c: float | None
    sink_c: float | None
    setpoint_c: float | None
    duty: float
    limited: tuple[str, ...]
    bad_frames: int
    refused: int
    dose_cem43: float
    heated_s: int
    reset_cause: int


def frame(type: int, seq: int, payload: bytes = b"") -> bytes:
    """Return the bytes of one message on the line."""
    body = bytes([type, seq]) + payload
    body += binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "little")
    return stuffed(body) + b"\0"


def stuffed(body: bytes) -> bytes:
    """Encode COBS without the final zero; each block here is under 254 bytes."""
    return b"".join(bytes([len(block) + 1]) + block for block in body.split(b"\0"))


def unstuffed(wire: bytes) -> bytes | None:
    """Decode COBS; None when it is invalid."""
    body, at = bytearray(), 0
    while at < len(wire):
        code = wire[at]
        if code == 0 or at + code > len(wire):
            return None
        body += wire[at + 1 : at + code]
        at += code
        if at < len(wire) and code < 255:
            body.append(0)
    return bytes(body)


def opened(wire: bytes) -> bytes | None:
    """Return type, seq and payload of a frame without its zero; None when it is damaged."""
    body = unstuffed(wire)
    if body is None or len(body) < 4:
        return None
    crc = int.from_bytes(body[-2:], "little")
    return body[:-2] if binascii.crc_hqx(body[:-2], 0xFFFF) == crc else None


def setpoint(setpoint_c: float, ttl_s: float = 0.25) -> bytes:
    """Return the payload of SETPOINT."""
    return struct.pack("<iH", round(setpoint_c * 1000), round(ttl_s * 1000))


def telemetry(payload: bytes) -> Telemetry:
    """Read the payload of TELEMETRY."""
    uptime, state, faults, plate, plate2, sink, setpoint, duty, limited, *counts = (
        _TELEMETRY.unpack(payload)
    )
    bad, refused, dose, heated, cause = counts
    return Telemetry(
        uptime / 1000.0,
        STATES[state],
        tuple(name for number, name in enumerate(FAULTS) if faults >> number & 1),
        _celsius(plate),
        _celsius(plate2),
        _celsius(sink),
        _celsius(setpoint),
        duty / 1000.0,
        tuple(name for bit, name in LIMITS.items() if limited & bit),
        bad,
        refused,
        dose / 1000.0,
        heated,
        cause,
    )


def _celsius(millidegrees: int) -> float | None:
    return None if millidegrees == NO_READING else millidegrees / 1000.0
