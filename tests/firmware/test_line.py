"""Damage on the serial line: counted, never executed, and the next valid frame is carried out."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator

import pytest

from . import line
from .rawhost import RawHost

HELD_C = 34.0


@pytest.fixture
def holding(host: RawHost) -> Iterator[RawHost]:
    """A host that holds 34 degC and has no unanswered message."""
    host.hold(HELD_C, 3.0)
    yield host
    assert host.board.resets == 0
    telemetry = host.state()
    assert telemetry.state == "holding"
    assert telemetry.setpoint_c == pytest.approx(HELD_C, abs=0.01)
    bad = telemetry.bad_frames
    host.hold(HELD_C + 1.0, 0.5)
    assert host.acks[-1] == (line.SETPOINT, host.acks[-1][1], "ok")
    assert host.state().bad_frames == bad


def test_a_frame_that_dribbles_in_is_obeyed(host: RawHost) -> None:
    host.hold(HELD_C, 1.0)
    for byte in line.frame(line.SETPOINT, 9, line.setpoint(36.0, 1.0)):
        host.board.write(bytes([byte]))
        host.advance(0.01)
    host.advance(0.05)

    assert (line.SETPOINT, 9, "ok") in host.acks


def flood(host: RawHost, bytes_a_slice: int) -> int:
    """Send noise and some valid setpoints for 2 s; return the number of telemetry messages."""
    chance = random.Random(2)
    reports = 0
    for slice in range(200):
        host.board.write(chance.randbytes(bytes_a_slice))
        if slice % 10 == 0:
            host.board.write(b"\0")
            host.send(line.SETPOINT, line.setpoint(HELD_C, 1.0))
        host.telemetry = None
        host.advance(0.01)
        reports += host.telemetry is not None
    host.board.write(b"\0")
    return reports


def test_good_frames_amid_a_flood_are_obeyed(holding: RawHost) -> None:
    holding.acks.clear()
    reports = flood(holding, 200)
    holding.advance(0.05)

    assert len(holding.acks) == 20
    assert reports >= 0.95 * 2.0 * 20, "twenty times a second"
    assert abs(holding.board.plant.plate_c - HELD_C) < 0.5


def test_a_flood_at_line_rate_starves_neither_control_nor_telemetry(host: RawHost) -> None:
    host.hold(HELD_C, 3.0)
    reports = flood(host, 250)
    host.advance(0.2)

    assert reports >= 0.95 * 2.0 * 20, "twenty times a second"
    assert host.board.resets == 0
    assert host.state().faults == ()
    host.board.write(b"\0")
    host.hold(HELD_C, 0.3)
    assert host.state().state == "holding"


def test_noise_alone_never_switches_anything_on(host: RawHost) -> None:
    chance = random.Random(3)
    for _ in range(200):
        host.board.write(chance.randbytes(240))
        host.advance(0.01)

    assert host.board.last_driven_at == 0.0
    assert host.state().faults == ()


@pytest.mark.parametrize(
    ("type", "payload", "answer"),
    [
        (line.SETPOINT, line.setpoint(17.999), "range"),
        (line.SETPOINT, line.setpoint(40.001), "range"),
        (line.SETPOINT, struct.pack("<iH", -(2**31), 250), "range"),
        (line.SETPOINT, struct.pack("<iH", 2**31 - 1, 250), "range"),
        (line.SETPOINT, line.setpoint(32.0, 0.0), "ttl"),
        (line.SETPOINT, line.setpoint(32.0, 1.001), "ttl"),
        (line.SETPOINT, line.setpoint(32.0)[:-1], "length"),
        (line.SETPOINT, line.setpoint(32.0) + b"\0", "length"),
        (line.OFF, b"\0", "length"),
        (line.CLEAR, b"", "length"),
        (line.HELLO, b"\x02\x00", "version"),
        (line.CLEAR, b"\x01", "not_latched"),
        (line.CLEAR, b"\xff", "not_latched"),
        (0x55, b"", "unknown"),
        (line.TELEMETRY, b"", "unknown"),
    ],
)
def test_nonsense_that_passes_its_crc_is_refused(
    host: RawHost, type: int, payload: bytes, answer: str
) -> None:
    refused = host.state().refused

    assert host.ask(type, payload) == answer
    assert host.state().refused == refused + 1
    assert not host.board.is_driven


def test_a_burst_of_greetings_costs_whole_frames_and_damages_none(host: RawHost) -> None:
    # Five HELLO_REPLYs and ACKs fill the board's transmit ring: what has no room is left out whole.
    for _ in range(50):
        host.board.write(5 * line.frame(line.HELLO, 1, b"\x01\x00"))
        host.advance(0.1)

    assert host.damaged == 0
    assert len(host.greetings) > 50
