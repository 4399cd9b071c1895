"""The firmware's documents agree with its headers."""

from __future__ import annotations

import re
import struct

import pytest

from hapticvlm.rendering.heat import limits as plate_limits

from .build import FIRMWARE, constant

HEADER = (FIRMWARE / "core" / "protocol.h").read_text()
PROTOCOL = (FIRMWARE / "PROTOCOL.md").read_text()
README = (FIRMWARE / "README.md").read_text()


def values(name: str) -> dict[str, int]:
    """Return the members of one enum of the header."""
    body = re.search(rf"enum (?:class )?{name} : uint8_t {{(.*?)}};", HEADER, re.DOTALL)
    assert body is not None
    found = re.findall(r"(\w+) = (0x[0-9A-Fa-f]+|\d+),?", body[1])
    return {member: int(number, 0) for member, number in found}


def test_every_fault_of_the_header_is_explained_by_its_number() -> None:
    rows = re.findall(r"^\| (\d+) \| ([A-Z_]+) \| .+ \| .+ \|$", README, re.MULTILINE)
    faults = values("Fault")
    end = faults.pop("FAULTS_END")

    assert {name: int(number) for number, name in rows} == faults
    assert sorted(faults.values()) == list(range(1, end))
    assert end <= 32, "a bit of telemetry for each"


def test_every_message_is_described_with_its_type() -> None:
    rows = re.findall(r"^\| (0x[0-9A-F]{2}) \| ([A-Z_]+) \|", PROTOCOL, re.MULTILINE)

    assert {name: int(number, 16) for number, name in rows} == values("Message")


def test_every_answer_is_described_with_its_code() -> None:
    section = PROTOCOL.split("ACK codes")[1].split("## Pins")[0]
    rows = re.findall(r"^\| (\d+) \| [a-z_]+ \|", section, re.MULTILINE)

    assert sorted(map(int, rows)) == sorted(values("Answer").values())


def test_the_layouts_have_the_sizes_of_the_header() -> None:
    reply, telemetry = re.findall(r"`(<[A-Za-z]+)`", PROTOCOL)

    assert f"HELLO_REPLY_BYTES = {struct.calcsize(reply)}," in HEADER
    assert f"TELEMETRY_BYTES = {struct.calcsize(telemetry)}," in HEADER


@pytest.mark.parametrize(
    ("name", "limit_c"),
    [
        ("TRIP_HIGH_C", plate_limits.PLATE_TRIP_HIGH_C),
        ("TRIP_LOW_C", plate_limits.PLATE_TRIP_LOW_C),
        ("SINK_TRIP_C", plate_limits.SINK_TRIP_C),
        ("SETPOINT_LOW_C", plate_limits.SETPOINT_MIN_C),
        ("SETPOINT_HIGH_C", plate_limits.SETPOINT_MAX_C),
        ("DOSE_LIMIT_CEM43", plate_limits.DOSE_LIMIT_CEM43),
        ("HEAT_LIMIT_S", plate_limits.HEAT_LIMIT_S),
    ],
)
def test_the_board_trips_where_the_service_believes_it_does(name: str, limit_c: float) -> None:
    assert constant(name) == limit_c


def test_the_page_names_the_trips_of_the_header() -> None:
    trip_c, warm_c = constant("SINK_TRIP_C"), constant("SINK_WARM_C")

    assert f"the sink goes from {warm_c:g} to {trip_c:g} degC" in README
    assert f"| SINK_HOT | the sink reached {trip_c:g} degC |" in README
