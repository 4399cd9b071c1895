"""Tests frames and messages of the plate: no damaged frame passes, and nothing raises."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest
from each_case import each
from hypothesis import given, settings
from hypothesis import strategies as st

from hapticvlm.devices.plate import framing
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer, Frame, frame, stuff, unstuff

MAX_PAYLOAD = 48
MAX_WIRE = 54

FIRMWARE = Path(__file__).parents[2] / "firmware"
byte = st.integers(0, 255)
frames = st.builds(Frame, byte, byte, st.binary(max_size=MAX_PAYLOAD))
messages = st.one_of(
    st.builds(plate_protocol.Hello, byte, byte),
    st.builds(plate_protocol.Setpoint, st.integers(-(2**31), 2**31 - 1), st.integers(0, 65535)),
    st.just(plate_protocol.Off()),
    st.just(plate_protocol.Rest()),
    st.builds(plate_protocol.Clear, byte),
    st.builds(plate_protocol.Ack, byte, byte, byte),
)
TELEMETRY = plate_protocol.Telemetry(
    uptime_ms=123_456,
    state=plate_protocol.State.HOLDING,
    faults=0,
    plate_mc=25_125,
    plate2_mc=25_200,
    sink_mc=None,
    setpoint_mc=25_000,
    duty=-310,
    limited=4,
    bad_frames=1,
    refused=2,
    dose_mcem43=3,
    heated_s=40,
    reset_cause=1,
)
SENT = (
    plate_protocol.Hello(1, 0),
    plate_protocol.Setpoint(25_000, 250),
    plate_protocol.Off(),
    plate_protocol.Clear(13),
    TELEMETRY,
)


def numbers(enum: str) -> dict[str, int]:
    """The numbers of one enum of the firmware's header."""
    header = (FIRMWARE / "core" / "protocol.h").read_text(encoding="utf-8")
    body = re.search(rf"enum (?:class )?{enum}[^{{]*{{(.*?)}};", header, re.DOTALL)
    assert body is not None
    return {name: int(number, 0) for name, number in re.findall(r"(\w+) = (\w+)", body[1])}


def flipped(data: bytes, bit: int) -> bytes:
    damaged = bytearray(data)
    damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def test_the_crc_is_the_one_of_the_protocol() -> None:
    content = Frame(ord("1"), ord("2"), b"3456789")

    assert unstuff(frame(content)[1:-1]) == b"123456789" + (0x29B1).to_bytes(2, "little")


@pytest.mark.parametrize(
    ("raw", "stuffed"),
    [
        (b"", b"\x01"),
        (b"\0", b"\x01\x01"),
        (b"\0\0", b"\x01\x01\x01"),
        (b"\x11\x22\0\x33", b"\x03\x11\x22\x02\x33"),
        (b"\x11\0\0\0", b"\x02\x11\x01\x01\x01"),
    ],
)
def test_cobs_writes_the_published_examples(raw: bytes, stuffed: bytes) -> None:
    assert stuff(raw) == stuffed


@given(st.binary(max_size=1200))
def test_cobs_writes_no_zero_and_loses_nothing(raw: bytes) -> None:
    stuffed = stuff(raw)

    assert 0 not in stuffed
    assert unstuff(stuffed) == raw


@pytest.mark.parametrize("length", [253, 254, 255, 508, 509])
def test_cobs_holds_at_its_longest_block(length: int) -> None:
    for raw in (b"\x07" * length, b"\x07" * length + b"\0", b"\0" + b"\x07" * length):
        assert unstuff(stuff(raw)) == raw


@given(st.binary(max_size=300))
def test_no_bytes_make_cobs_raise(stuffed: bytes) -> None:
    raw = unstuff(stuffed)

    assert raw is None or len(raw) <= len(stuffed)


@given(st.lists(frames, max_size=6), st.data())
def test_frames_arrive_whole_however_the_line_cuts_them(
    sent: list[Frame], data: st.DataObject
) -> None:
    stream = b"".join(frame(content) for content in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    deframer, got = Deframer(), []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        got += deframer.feed(stream[begin:end])

    assert got == sent
    assert deframer.bad == 0


@given(messages, byte)
def test_a_message_survives_the_line(message: plate_protocol.Message, seq: int) -> None:
    (received,) = Deframer().feed(plate_protocol.encode(message, seq))

    assert received.seq == seq
    assert plate_protocol.decode(received) == message


# A flip in a COBS code byte moves zeros about: more than one bit, which a CRC of 16 bits misses
# once in 65536. Hence every flip of given frames, not of random ones.
@each(message=SENT, seq=[0, 1, 77, 255])
def test_no_single_bit_error_is_accepted(message: plate_protocol.Message, seq: int) -> None:
    good = plate_protocol.encode(message, seq)
    for bit in range(len(good) * 8):
        deframer = Deframer()
        got = deframer.feed(flipped(good, bit) + b"\0")
        assert got == [], bit
        assert deframer.bad >= 1


@pytest.mark.parametrize("message", SENT, ids=lambda message: type(message).__name__)
def test_no_truncated_frame_is_accepted(message: plate_protocol.Message) -> None:
    good = plate_protocol.encode(message, 9)
    for length in range(1, len(good) - 1):
        assert Deframer().feed(good[:length] + b"\0") == [], length


@given(st.lists(st.binary(max_size=200), max_size=20))
@settings(derandomize=True)
def test_garbage_is_counted_and_the_next_frame_arrives(garbage: list[bytes]) -> None:
    deframer = Deframer()
    for part in garbage:
        deframer.feed(part)
    deframer.feed(b"\0")
    (received,) = deframer.feed(plate_protocol.encode(TELEMETRY, 3))

    assert plate_protocol.decode(received) == TELEMETRY


def test_a_line_that_never_ends_a_frame_is_not_kept() -> None:
    deframer = Deframer()
    for _ in range(1000):
        deframer.feed(b"\x55" * 100)

    assert len(deframer._pending) < MAX_WIRE
    assert deframer.feed(b"\0" + plate_protocol.encode(TELEMETRY, 0))
    assert deframer.bad == 1


def test_a_frame_of_the_longest_payload_passes_and_one_byte_more_does_not() -> None:
    longest = Frame(1, 2, b"\x09" * MAX_PAYLOAD)

    assert len(frame(longest)) == 1 + MAX_WIRE
    assert Deframer().feed(frame(longest)) == [longest]
    assert Deframer().feed(frame(Frame(1, 2, b"\x09" * (MAX_PAYLOAD + 1)))) == []


def test_noise_between_two_frames_costs_neither() -> None:
    deframer = Deframer()

    assert deframer.feed(frame(Frame(1, 2, b"a")) + b"\x55\xaa" + frame(Frame(1, 3, b"b"))) == [
        Frame(1, 2, b"a"),
        Frame(1, 3, b"b"),
    ]
    assert deframer.bad == 1


def test_idle_zeros_are_free() -> None:
    deframer = Deframer()

    assert deframer.feed(b"\0" * 50) == []
    assert deframer.bad == 0


@given(byte, st.binary(max_size=MAX_PAYLOAD))
def test_a_payload_of_any_size_is_a_message_or_refused(kind: int, payload: bytes) -> None:
    try:
        message = plate_protocol.decode(Frame(kind, 0, payload))
    except plate_protocol.LineError:
        return
    (again,) = Deframer().feed(plate_protocol.encode(message, 0))
    assert again == Frame(kind, 0, payload)


def test_no_reading_is_none_and_zero_is_zero_degrees() -> None:
    layout = struct.Struct("<IBIiiiihBHHHHB")
    values = (0, 0, 0, -(2**31), 0, -(2**31), 0, 0, 0, 0, 0, 0, 0, 0)
    telemetry = plate_protocol.decode(Frame(0x82, 0, layout.pack(*values)))

    assert isinstance(telemetry, plate_protocol.Telemetry)
    assert (telemetry.plate_mc, telemetry.plate2_mc, telemetry.sink_mc, telemetry.setpoint_mc) == (
        None,
        0,
        None,
        0,
    )


def test_the_numbers_are_those_of_the_firmware() -> None:
    kinds, sizes = numbers("Message"), numbers(": uint8_t")
    assert sizes == {"PROTOCOL_MAJOR": plate_protocol.MAJOR, "PROTOCOL_MINOR": plate_protocol.MINOR}
    for kind, (message, _) in plate_protocol._LAYOUTS.items():
        name = re.sub(r"(?<!^)([A-Z])", r"_\1", message.__name__).upper()
        assert kinds.pop(name) == kind
    assert not kinds
    assert [*numbers("Answer").values()] == [*plate_protocol.Answer]
    assert {name.upper(): n for name, n in numbers("State").items()} == {
        state.name: state.value for state in plate_protocol.State
    }


def test_the_sizes_are_those_of_the_firmware() -> None:
    header = (FIRMWARE / "core" / "protocol.h").read_text(encoding="utf-8")
    stated = {name: int(size) for name, size in re.findall(r"(\w+)_BYTES = (\d+)", header)}
    for message, layout in plate_protocol._LAYOUTS.values():
        name = re.sub(r"(?<!^)([A-Z])", r"_\1", message.__name__).upper()
        assert stated.get(name, 0) == layout.size
    assert f"MAX_PAYLOAD = {framing.MAX_PAYLOAD}," in header
    assert f"LIMIT_CURRENT = 1 << {plate_protocol.LIMITED_BY_CURRENT.bit_length() - 1}," in header
