"""The circuit that is documented is the one that firmware and simulation assume."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections import Counter

import pytest

from .build import FIRMWARE
from .hardware import (
    BYPASS_OHM,
    COOL_LIMIT_A,
    CUT_OUT_COLD_C,
    CUT_OUT_HOT_C,
    DIVIDER_OHM,
    FULL_SCALE_A,
    HEAT_LIMIT_A,
    R25_OHM,
    SERIES_OHM,
    SUPPLY_V,
    Driver,
)

HARDWARE = FIRMWARE / "hardware"
sys.path.insert(0, str(HARDWARE))

parts = importlib.import_module("parts")


def test_the_drawing_and_the_wiring_are_those_of_the_parts() -> None:
    command = [sys.executable, str(HARDWARE / "circuit.py"), "--check"]

    assert subprocess.run(command, check=False).returncode == 0


def test_the_pictures_of_the_first_rungs_are_current_and_name_the_pins_of_the_protocol() -> None:
    command = [sys.executable, str(HARDWARE / "rungs.py"), "--check"]
    pins = (FIRMWARE / "PROTOCOL.md").read_text().split("## Pins")[1]

    assert subprocess.run(command, check=False).returncode == 0
    for pin, words in {"D8": "driver enable", "D9": "heat", "D10": "cool", "D7": "cut-out"}.items():
        row = next(line for line in pins.splitlines() if f"({pin})" in line)
        assert words in row
    assert "(A0, A1) | plate thermistors" in pins
    assert "(D13, the LED marked L)" in pins


def test_no_net_ends_at_a_single_pin() -> None:
    count = Counter(net for part in parts.PARTS for net in part.pins.values())

    assert [net for net, pins in count.items() if pins < 2] == []


def test_every_part_is_drawn() -> None:
    drawn = (HARDWARE / "circuit.svg").read_text()

    assert [part.name for part in parts.PARTS if f">{part.name} " not in drawn] == []


def test_the_board_is_wired_to_the_pins_of_the_protocol() -> None:
    pins = (FIRMWARE / "PROTOCOL.md").read_text().split("## Pins")[1]
    named = set(re.findall(r"\b([AD]\d+)\b", pins)) - {"D0", "D1", "D13"}  # USB and L

    assert named == set(parts.BY_NAME["U1"].pins) - {"5V", "GND"}


def test_the_cut_out_opens_where_the_simulation_has_it() -> None:
    cold_c, hot_c = parts.cut_out_c()

    assert cold_c == pytest.approx(CUT_OUT_COLD_C, abs=0.05)
    assert hot_c == pytest.approx(CUT_OUT_HOT_C, abs=0.05)


def test_the_bead_of_the_cut_out_can_be_taken_for_no_other() -> None:
    plate, cut_out = parts.number("RT1"), parts.number("RT4")

    assert cut_out == 10.0 * plate, "an order of magnitude: a mix-up shows at once"
    assert plate == R25_OHM
    assert parts.number("R1") == DIVIDER_OHM


def test_the_resistors_on_the_module_limit_a_shorted_driver_to_what_the_firmware_may_ask() -> None:
    resistors = parts.number("J2"), parts.number("R13"), parts.number("R14")
    assert resistors == (SUPPLY_V, SERIES_OHM, BYPASS_OHM)

    assert Driver(shorted=1).current_a(0.0) == pytest.approx(HEAT_LIMIT_A, rel=0.02)
    assert -Driver(shorted=-1).current_a(0.0) == pytest.approx(COOL_LIMIT_A, rel=0.02)


def test_full_duty_asks_the_driver_for_the_full_scale() -> None:
    assert parts.full_scale_a() == pytest.approx(FULL_SCALE_A, rel=0.02)
