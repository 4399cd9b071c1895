"""The documented circuit matches the assumptions of firmware and simulation."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from itertools import chain, combinations
from typing import Any

import pytest
from each_case import each

from .build import FIRMWARE, Chip, constant
from .hardware import (
    BYPASS_OHM,
    COOL_LIMIT_A,
    CUT_OUT_BETA_K,
    CUT_OUT_COLD_C,
    CUT_OUT_HOT_C,
    CUT_OUT_R25_OHM,
    DIVIDER_OHM,
    FULL_SCALE_A,
    HEAT_LIMIT_A,
    ONE_SERIES_OHM,
    R25_OHM,
    SENSE_OHM,
    SERIES_OHM,
    SUPPLY_V,
    Driver,
)
from .netlist import DrawnDriver, Netlist
from .rawhost import RawHost

HARDWARE = FIRMWARE / "hardware"
sys.path.insert(0, str(HARDWARE))

parts = importlib.import_module("parts")


def test_the_drawing_and_the_wiring_are_those_of_the_parts() -> None:
    command = [sys.executable, str(HARDWARE / "circuit.py"), "--check"]

    assert subprocess.run(command, check=False).returncode == 0


def test_the_pictures_of_the_rungs_are_current_and_have_the_names_of_the_circuit() -> None:
    command = [sys.executable, str(HARDWARE / "rungs.py"), "--check"]
    pins = (FIRMWARE / "PROTOCOL.md").read_text().split("## Pins")[1]

    assert subprocess.run(command, check=False).returncode == 0
    for pin, words in {
        "D6": "cut-out",
        "D7": "cut-out",
        "D8": "driver enable",
        "D9": "heat",
        "D10": "cool",
    }.items():
        row = next(line for line in pins.splitlines() if f"({pin})" in line)
        assert words in row
    assert "(A0, A1) | plate thermistors" in pins
    assert "(D13, the LED marked L)" in pins
    drawn = set(re.findall(r"\b(?:[ADJKR]|RT)\d+\b", (HARDWARE / "rung2c.svg").read_text()))
    board = parts.BY_NAME["U1"].pins.keys()
    assert {"D6", "D7", "D8", "D9", "D10", "A0", "A1", "A2", "A3"} == drawn & board
    assert {"R13", "K1", "RT4"} == drawn - board


PLATES = {"full": parts.PARTS, "one resistor": parts.ONE_RESISTOR}


@pytest.fixture(params=PLATES)
def by_name(request: pytest.FixtureRequest) -> dict[str, Any]:
    """The parts of each plate by their names."""
    return {part.name: part for part in PLATES[request.param]}


def test_no_net_ends_at_a_single_pin(by_name: dict[str, Any]) -> None:
    count = Counter(net for part in by_name.values() for net in part.pins.values())

    assert [net for net, pins in count.items() if pins < 2] == []


def test_every_part_is_drawn() -> None:
    drawn = (HARDWARE / "circuit.svg").read_text()

    assert [part.name for part in parts.PARTS if f">{part.name} " not in drawn] == []


def test_the_board_is_wired_to_the_pins_of_the_protocol(by_name: dict[str, Any]) -> None:
    pins = (FIRMWARE / "PROTOCOL.md").read_text().split("## Pins")[1]
    named = set(re.findall(r"\b([AD]\d+)\b", pins)) - {"D0", "D1", "D13"}  # USB and L

    assert named == set(by_name["U1"].pins) - {"5V", "GND"}


def test_the_cut_out_opens_where_the_simulation_has_it() -> None:
    cold_c, hot_c = parts.cut_out_c()

    assert cold_c == pytest.approx(CUT_OUT_COLD_C, abs=0.05)
    assert hot_c == pytest.approx(CUT_OUT_HOT_C, abs=0.05)


CONDUCTS, SAYS_OPEN = frozenset({"+5V", "SW"}), frozenset({"SENSE", "GND"})


def test_the_board_never_sees_an_open_cut_out_whose_relay_may_conduct() -> None:
    states = contact_states(parts.BY_NAME["K1"].pins)

    assert {CONDUCTS} in states, "the supply is switched on, or its contact is welded"
    assert {SAYS_OPEN} in states, "the board can see it open"
    assert [closed for closed in states if closed >= {CONDUCTS, SAYS_OPEN}] == []


def test_a_make_contact_would_tell_the_board_nothing_of_a_weld() -> None:
    pins = parts.BY_NAME["K1"].pins
    second_make = {("24" if pin == "22" else pin): net for pin, net in pins.items()}
    welded = [closed for closed in contact_states(second_make) if CONDUCTS in closed]

    assert {SAYS_OPEN in closed for closed in welded} == {True, False}


def contact_states(pins: dict[str, str]) -> list[set[frozenset[str]]]:
    """Return every set of nets that a force-guided relay may connect, whatever is welded or worn.

    A make contact (terminals x1-x4) and a break contact (x1-x2) are never closed together. Contacts
    of the same kind promise nothing about each other.
    """
    contacts = [
        (pin[1], frozenset({pins[pin[0] + "1"], net}))
        for pin, net in pins.items()
        if pin[1] in "24" and pin.isdigit()
    ]
    subsets = (combinations(contacts, size) for size in range(len(contacts) + 1))
    return [
        {nets for _, nets in closed}
        for closed in chain.from_iterable(subsets)
        if len({kind for kind, _ in closed}) < 2
    ]


# Of the MAX1968 (public symbol libraries of KiCad and PADS), numbered pins of one function as one.
SIGNALS = {"CTLI", "REF", "MAXIP", "MAXIN", "MAXV", "SHDN", "COMP", "FREQ", "ITEC"}
CHIP_PINS = SIGNALS | {"VDD", "PVDD", "GND", "PGND", "LX1", "LX2", "OS1", "OS2", "CS"}


def test_every_pin_of_the_driver_is_drawn_or_wired_on_its_kit() -> None:
    drawn = set(parts.BY_NAME["U3"].pins)

    assert drawn | set(parts.ON_KIT) == CHIP_PINS
    assert drawn & set(parts.ON_KIT) == set()


def test_nothing_but_a_resistor_drives_a_driver_without_supply() -> None:
    inputs = set(parts.BY_NAME["U3"].pins.values()) - {"GND"}
    outputs = {*parts.BY_NAME["U1"].pins.values(), parts.BY_NAME["U2A"].pins["out"]}

    assert inputs & outputs == set(), "the cut-out takes the driver's supply, not the board's"


def test_the_bead_of_the_cut_out_can_be_taken_for_no_other() -> None:
    plate, cut_out = parts.number("RT1"), parts.number("RT4")

    assert cut_out == 10.0 * plate, "an order of magnitude: a mix-up shows at once"
    assert (plate, cut_out) == (R25_OHM, CUT_OUT_R25_OHM)
    assert (parts.number("R1"), parts.number("R15")) == (DIVIDER_OHM, CUT_OUT_R25_OHM)
    assert parts.BEAD_BETA_K == CUT_OUT_BETA_K == constant("CUT_OUT_BETA_K")


def test_one_resistor_alone_is_between_bridge_and_module() -> None:
    by_name = {part.name: part for part in parts.ONE_RESISTOR}
    bridge, module = by_name["U3"].pins, by_name["TEC1"].pins
    at = {
        net: {part.name for part in by_name.values() if net in part.pins.values()}
        for net in (bridge["OUT1"], bridge["OUT2"], module["+"])
    }

    assert at[bridge["OUT1"]] == {"U3", "R13"}
    assert at[module["+"]] == {"R13", "TEC1"}
    assert at[bridge["OUT2"]] == {"U3", "TEC1"}
    assert by_name["R13"].value == ONE_SERIES_OHM
    # Heat flows from minus to plus, as in the full plate.
    assert (bridge["IN2"], bridge["OUT2"]) == (by_name["U1"].pins["D9"], module["-"])
    assert (bridge["VM"], bridge["EEP"]) == ("SW", by_name["U1"].pins["D8"])


@pytest.mark.parametrize(("most_parts", "most_eur"), [(25, 75.0), (57, 250.0)])
def test_a_plate_is_small_and_cheap(most_parts: int, most_eur: float) -> None:
    one = most_parts == 25
    names = [part.name for part in (parts.ONE_RESISTOR if one else parts.PARTS)]

    assert len({name.rstrip("AB") for name in names}) <= most_parts
    eur = sum(parts.price_eur(name, has_one_resistor=one) for name in names)
    assert eur + parts.SINK_EUR <= most_eur


def test_the_relay_of_one_resistor_holds_only_while_the_board_lets_it() -> None:
    by_name = {part.name: part for part in parts.ONE_RESISTOR}
    leave = by_name["Q2"].pins

    assert (leave["D"], leave["S"]) == (by_name["K1"].pins["coil-"], "GND")
    assert leave["G"] == by_name["U1"].pins["D6"]
    assert set(by_name["R26"].pins.values()) == {leave["G"], "GND"}


def test_the_relay_holds_only_while_comparator_and_board_let_it() -> None:
    coil, ends = parts.BY_NAME["K1"].pins["coil-"], set()
    for name in ("Q1", "Q2"):
        pins = parts.BY_NAME[name].pins
        assert pins["D"] == coil, "the transistors are in series"
        coil = pins["S"]
        ends.add(pins["G"])
    assert coil == "GND"
    assert ends == {parts.BY_NAME["U4A"].pins["out"], parts.BY_NAME["U1"].pins["D6"]}
    assert set(parts.BY_NAME["R26"].pins.values()) == {parts.BY_NAME["U1"].pins["D6"], "GND"}


def test_the_board_reads_the_bead_of_the_cut_out_and_cannot_move_it() -> None:
    board = set(parts.BY_NAME["U1"].pins.values()) - {"BOARD5V", "GND"}
    at_bead = [part.name for part in parts.PARTS if "BEAD" in part.pins.values()]

    assert sorted(at_bead) == ["C6", "R15", "RT4", "U2B", "U4A", "U4B"]
    assert not board & {*parts.BY_NAME["R15"].pins.values(), *parts.BY_NAME["RT4"].pins.values()}
    follower = parts.BY_NAME["U2B"].pins
    assert (follower["+"], follower["out"]) == ("BEAD", parts.BY_NAME["U1"].pins["A3"])


def test_the_resistors_on_the_module_limit_a_shorted_driver() -> None:
    resistors = parts.number("J2"), parts.number("R13"), parts.number("R14"), parts.number("RS")
    assert resistors == (SUPPLY_V, SERIES_OHM, BYPASS_OHM, SENSE_OHM)

    assert Driver(shorted=1).current_a(0.0) <= 1.1 * HEAT_LIMIT_A
    assert -Driver(shorted=-1).current_a(0.0) <= 1.15 * COOL_LIMIT_A


def test_a_sound_driver_reaches_the_currents_that_the_firmware_asks_for() -> None:
    heat, cool = HEAT_LIMIT_A / FULL_SCALE_A, -COOL_LIMIT_A / FULL_SCALE_A

    assert Driver().current_a(heat) == pytest.approx(HEAT_LIMIT_A, rel=0.01)
    assert -Driver().current_a(cool) == pytest.approx(COOL_LIMIT_A, rel=0.02)
    assert -Driver().current_a(cool, emf_v=-0.13) > 0.95 * COOL_LIMIT_A  # 10 degC against it


def test_the_driver_limits_its_current_by_itself_to_what_the_firmware_may_ask() -> None:
    assert parts.driver_limits_a() == pytest.approx((COOL_LIMIT_A, HEAT_LIMIT_A), rel=0.02)


@each(
    duty=[-1.0, -2 / 3, -0.5, -0.1, 0.0, 0.1, 0.4, 0.6],
    emf_v=[-0.3, 0.0, 0.3],
)
def test_the_drawn_circuit_gives_the_current_that_the_simulation_assumes(
    duty: float, emf_v: float
) -> None:
    drawn, simulated = DrawnDriver(Netlist(parts.PARTS)), Driver()

    drawn_a = drawn.current_a(duty, emf_v)
    assert drawn_a == pytest.approx(simulated.current_a(duty, emf_v), rel=0.02, abs=0.001)


@pytest.mark.parametrize("direction", [1, -1])
def test_the_drawn_circuit_limits_a_shorted_bridge_as_the_simulation_assumes(
    direction: int,
) -> None:
    drawn = -Netlist(parts.PARTS).shorted(direction).module_a

    assert drawn == pytest.approx(Driver(shorted=direction).current_a(0.0), rel=0.02)


@pytest.mark.parametrize("duty", [-0.5, 0.2])
def test_the_whole_current_of_the_module_passes_the_sense_resistor(duty: float) -> None:
    flow = Netlist(parts.PARTS).flow(duty)

    assert abs(flow.through_a["RS"]) == pytest.approx(abs(flow.module_a), rel=1e-3)
    assert abs(flow.module_a) == pytest.approx(abs(duty) * FULL_SCALE_A, rel=0.02)


def test_a_plug_turned_round_exchanges_heat_and_cold_but_not_their_limits() -> None:
    turned = Netlist(parts.PARTS, turned=True)

    assert -turned.flow(-1.0).module_a == pytest.approx(Driver().current_a(1.0), rel=0.02)
    assert -turned.flow(0.1).module_a == pytest.approx(-0.3, rel=0.02)


@pytest.mark.parametrize(
    ("part", "pins"),
    [
        ("J1", {"1": "CS"}),  # the module in parallel to the sense resistor instead of behind it
        ("J1", {"1": "OS2", "2": "OS1"}),
        ("D1", {"A": "D1K", "K": "M1"}),
        ("U1", {"D9": "COOL", "D10": "HEAT"}),
        ("R14", {"2": "M2"}),
    ],
)
def test_a_pin_on_the_wrong_net_shows_in_the_current(part: str, pins: dict[str, str]) -> None:
    redrawn = [replace(it, pins=it.pins | pins) if it.name == part else it for it in parts.PARTS]
    currents = [-Netlist(redrawn).flow(duty).module_a for duty in (-1.0, 0.1)]

    assert currents != pytest.approx([-COOL_LIMIT_A, 0.3], rel=0.02)


def test_no_part_of_the_power_stage_carries_more_than_it_may() -> None:
    drawn = Netlist(parts.PARTS)
    # A turned or shorted bridge at the supply's end, and the module's own voltage at 40 K.
    flows = [drawn.shorted(way, emf_v) for way in (1, -1) for emf_v in (-0.5, 0.5)]
    for flow in flows:
        for name, most_w in parts.POWER_W.items():
            assert flow.through_a[name] ** 2 * parts.number(name) <= most_w
        for name, most_a in parts.CURRENT_A.items():
            assert abs(flow.through_a.get(name, flow.module_a)) <= most_a
    assert min(parts.REVERSE_V.values()) > 2.0 * SUPPLY_V


def test_the_small_resistors_shed_less_than_they_may() -> None:
    for part in parts.PARTS:
        is_small = part.name.startswith("R") and part.name not in parts.POWER_W
        if is_small and isinstance(part.value, float):
            assert SUPPLY_V**2 / part.value <= parts.SMALL_POWER_W, part.name


@pytest.mark.parametrize("direction", [1, -1])
def test_the_resistors_beside_the_palm_stay_touchable_whatever_the_bridge_does(
    direction: int,
) -> None:
    flow = Netlist(parts.PARTS).shorted(direction)
    shed_w = sum(flow.through_a[name] ** 2 * parts.number(name) for name in ("R13", "R14"))

    assert 30.0 + shed_w * parts.RESISTORS_K_PER_W <= parts.TOUCHABLE_C


@pytest.mark.nightly
def test_the_plate_follows_on_the_drawn_circuit(chip: Chip) -> None:
    board = chip.board(23.0)
    board.driver = DrawnDriver(Netlist(parts.PARTS))
    host = RawHost(board)
    host.greet()
    for setpoint_c in (35.0, 26.0):
        host.hold(setpoint_c, 8.0)
        assert host.state().state == "holding"
        assert board.plant.plate_c == pytest.approx(setpoint_c, abs=0.4)
    board.close()


def test_full_duty_asks_the_driver_for_the_full_scale() -> None:
    assert parts.full_scale_a() == pytest.approx(FULL_SCALE_A, rel=0.02)
