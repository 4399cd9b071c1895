"""The documented circuit matches the assumptions of firmware and simulation."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from itertools import chain, combinations

import pytest
from each_case import each

from hapticvlm.devices.simulated.limiter import (
    BYPASS_OHM,
    CELL_FARAD,
    CELLS,
    SERIES_OHM,
    STORE_FARAD,
    Limiter,
)

from .build import FIRMWARE, Chip
from .hardware import (
    BURST_LIMIT_A,
    CHOKE_OHM,
    COOL_LIMIT_A,
    CUT_OUT_COLD_C,
    CUT_OUT_HOT_C,
    DIVIDER_OHM,
    FETS_OHM,
    FULL_SCALE_A,
    HEAT_LIMIT_A,
    LEADS_OHM,
    MODULE_OHM,
    R25_OHM,
    SENSE_OHM,
    SUPPLY_V,
    Driver,
)
from .netlist import STORE, DrawnDriver, Netlist
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
    for pin, words in {"D8": "driver enable", "D9": "heat", "D10": "cool", "D7": "cut-out"}.items():
        row = next(line for line in pins.splitlines() if f"({pin})" in line)
        assert words in row
    assert "(A0, A1) | plate thermistors" in pins
    assert "(D13, the LED marked L)" in pins
    drawn = set(re.findall(r"\b(?:[ADJKR]|RT)\d+\b", (HARDWARE / "rung2b.svg").read_text()))
    board = parts.BY_NAME["U1"].pins.keys()
    assert {"D7", "D8", "D9", "D10", "A0", "A1", "A2"} == drawn & board
    assert {"D1", "R13", "R14", "J1", "K1", "RT4"} == drawn - board
    assert drawn - board <= parts.BY_NAME.keys()


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
    outputs = {*parts.BY_NAME["U1"].pins.values(), parts.BY_NAME["U2"].pins["out"]}

    assert inputs & outputs == set(), "the cut-out takes the driver's supply, not the board's"


def test_the_bead_of_the_cut_out_can_be_taken_for_no_other() -> None:
    plate, cut_out = parts.number("RT1"), parts.number("RT4")

    assert cut_out == 10.0 * plate, "an order of magnitude: a mix-up shows at once"
    assert plate == R25_OHM
    assert parts.number("R1") == DIVIDER_OHM


FULL_V = 3.0  # of a store that 2 A of cooling have filled, and more


def filled(shorted: int = 0) -> Driver:
    """Return a driver whose store is full."""
    return Driver(shorted=shorted, limiter=Limiter(volts=FULL_V))


def test_the_resistors_on_the_module_limit_a_shorted_driver() -> None:
    resistors = parts.number("J2"), parts.number("R13"), parts.number("R14"), parts.number("RS")
    assert resistors == (SUPPLY_V, SERIES_OHM, BYPASS_OHM, SENSE_OHM)

    assert Driver(shorted=1).current_a(0.0) <= HEAT_LIMIT_A
    assert -lasting_a(Driver(shorted=-1)) <= 1.1 * COOL_LIMIT_A


def lasting_a(driver: Driver, duty: float = 0.0, emf_v: float = 0.0) -> float:
    """Return the current after the store has filled."""
    for _ in range(500):
        driver.carry(driver.current_a(duty, emf_v), 0.01)
    return driver.current_a(duty, emf_v)


def test_a_sound_driver_reaches_the_cold_that_the_firmware_asks_for() -> None:
    asked = -COOL_LIMIT_A / FULL_SCALE_A

    assert -lasting_a(Driver(), asked) == pytest.approx(COOL_LIMIT_A, rel=0.01)
    assert -lasting_a(Driver(), asked, emf_v=-0.13) > 0.97 * COOL_LIMIT_A  # 10 degC against it


def test_an_empty_store_lets_cooling_begin_with_the_burst_that_the_firmware_asks_for() -> None:
    driver = Driver()
    given_a = []
    for _ in range(500):
        given_a.append(-driver.current_a(-1.0))
        driver.carry(-given_a[-1], 0.01)

    assert given_a[0] == BURST_LIMIT_A
    assert 0.2 <= 0.01 * sum(current_a == BURST_LIMIT_A for current_a in given_a) <= 0.4
    assert given_a[-1] == pytest.approx(1.02 * COOL_LIMIT_A, rel=0.01)


def test_the_store_adds_no_more_than_its_charge_to_a_shorted_bridge_and_then_nothing() -> None:
    driver, without = Driver(shorted=-1), Driver(shorted=-1, limiter=Limiter(0.0))
    lasting_a = -without.current_a(0.0)
    more_c = 0.0
    for _ in range(500):
        current_a = -driver.current_a(0.0)
        driver.carry(-current_a, 0.01)
        more_c += 0.01 * (current_a - lasting_a)

    assert 0.3 < more_c < STORE_FARAD * FULL_V
    assert -driver.current_a(0.0) == pytest.approx(lasting_a, rel=0.001)


def test_heat_and_rest_empty_the_store() -> None:
    for current_a in (0.75, 0.0):
        driver = filled()
        driver.carry(current_a, 3.0)

        assert 0.0 <= driver.limiter.volts < 0.02


def test_a_store_steps_as_far_in_one_long_step_as_in_many_short_ones() -> None:
    for current_a in (3.0, 2.0, 0.5, 0.0):
        at_once, by_and_by = Limiter(volts=1.0), Limiter(volts=1.0)
        at_once.take(current_a, 0.3)
        for _ in range(300):
            by_and_by.take(current_a, 0.001)

        assert at_once.volts == pytest.approx(by_and_by.volts, rel=1e-6)


def test_the_store_is_the_drawn_one_and_its_cells_never_exceed_their_voltage() -> None:
    assert [parts.number(name) for name in STORE] == [CELL_FARAD] * CELLS
    driver = Driver(shorted=-1)
    lasting_a(driver, emf_v=0.5)  # a plate that is 40 degC hotter than its sink
    small, large = 1.0 - parts.CELL_TOLERANCE, 1.0 + parts.CELL_TOLERANCE
    for sound in (CELLS, CELLS - 1):  # one may be shorted
        share = (1.0 / small) / (1.0 / small + (sound - 1) / large)
        assert share * driver.limiter.volts < parts.CELL_V
    assert driver.limiter.volts > FULL_V


def test_the_firmware_knows_the_store() -> None:
    knows = {name: constant(name) for name in STORE_CONSTANTS}
    inner_ohm = inner_resistance()
    source_v = SUPPLY_V - 0.1  # of a plate that is 8 degC colder than its sink
    passes_a = [Limiter(volts=volts).most_a(source_v, inner_ohm) for volts in (0.0, 1.0)]
    assert knows["STORE_PASSES_A"] == pytest.approx(passes_a[0], rel=0.01)
    assert knows["STORE_OPPOSES_S"] == pytest.approx(passes_a[0] - passes_a[1], rel=0.01)
    for current_a, volts in ((3.0, 0.0), (2.0, 2.0), (3.0, 2.0), (0.0, 2.0)):
        limiter = Limiter(volts=volts)
        limiter.take(current_a, 1e-4)
        fills = knows["STORE_FILLS"] * current_a - knows["STORE_DIODE"]
        slope = max(fills - knows["STORE_LEAKS"] * volts, -knows["STORE_EMPTIES"] * volts)

        assert (limiter.volts - volts) / 1e-4 == pytest.approx(slope, rel=0.02, abs=0.05)


STORE_CONSTANTS = (
    "STORE_PASSES_A",
    "STORE_OPPOSES_S",
    "STORE_FILLS",
    "STORE_DIODE",
    "STORE_LEAKS",
    "STORE_EMPTIES",
)


def constant(name: str) -> float:
    """Return a constant of limits.h."""
    found = re.search(rf"\b{name} = ([0-9.]+)f", (FIRMWARE / "core" / "limits.h").read_text())
    assert found is not None
    return float(found[1])


def inner_resistance() -> float:
    """Return the resistance in series with the limiter behind a driver that works."""
    return MODULE_OHM + LEADS_OHM + SENSE_OHM + 2.0 * CHOKE_OHM + FETS_OHM


def test_the_driver_limits_its_current_by_itself_to_what_the_firmware_may_ask() -> None:
    assert parts.driver_limits_a() == pytest.approx((BURST_LIMIT_A, HEAT_LIMIT_A), rel=0.02)


@each(
    store_v=[0.0, 1.5, FULL_V],
    duty=[-1.0, -2 / 3, -0.5, -0.1, 0.0, 0.1, 0.2, 0.25],
    emf_v=[-0.3, 0.0, 0.3],
)
def test_the_drawn_circuit_gives_the_current_that_the_simulation_assumes(
    store_v: float, duty: float, emf_v: float
) -> None:
    drawn, simulated = DrawnDriver(Netlist(parts.PARTS)), Driver()
    drawn.limiter.volts = simulated.limiter.volts = store_v

    drawn_a = drawn.current_a(duty, emf_v)
    assert drawn_a == pytest.approx(simulated.current_a(duty, emf_v), rel=0.02, abs=0.001)


@pytest.mark.parametrize("store_v", [0.0, 1.5, FULL_V])
@pytest.mark.parametrize("direction", [1, -1])
def test_the_drawn_circuit_limits_a_shorted_bridge_as_the_simulation_assumes(
    direction: int, store_v: float
) -> None:
    drawn = -Netlist(parts.PARTS).shorted(direction, store_v=store_v).module_a
    simulated = Driver(shorted=direction, limiter=Limiter(volts=store_v))

    assert drawn == pytest.approx(simulated.current_a(0.0), rel=0.02)


@pytest.mark.parametrize("duty", [-0.5, 0.2])
def test_the_whole_current_of_the_module_passes_the_sense_resistor(duty: float) -> None:
    flow = Netlist(parts.PARTS).flow(duty)

    assert abs(flow.through_a["RS"]) == pytest.approx(abs(flow.module_a), rel=1e-3)
    assert abs(flow.module_a) == pytest.approx(abs(duty) * FULL_SCALE_A, rel=0.02)


def test_a_plug_turned_round_exchanges_heat_and_cold_but_not_their_limits() -> None:
    turned = Netlist(parts.PARTS, turned=True)

    assert -turned.flow(-1.0).module_a == pytest.approx(filled().current_a(1.0), rel=0.02)
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
    currents = [-Netlist(redrawn).flow(duty).module_a for duty in (-2 / 3, 0.1)]

    assert currents != pytest.approx([-COOL_LIMIT_A, 0.3], rel=0.02)


@pytest.mark.parametrize(
    ("part", "pins"),
    [
        ("C9", {"+": "M1"}),  # across the diode too
        ("C11", {"-": "D1K"}),  # the two others parallel to nothing
        ("C10", {"-": "STORE1"}),
        ("C9", {"-": "STORE2"}),  # around the second cell
    ],
)
def test_a_cell_on_the_wrong_net_shows_in_the_current(part: str, pins: dict[str, str]) -> None:
    redrawn = [replace(it, pins=it.pins | pins) if it.name == part else it for it in parts.PARTS]
    sound = [Netlist(parts.PARTS).shorted(-1, store_v=volts).module_a for volts in (0.0, FULL_V)]
    currents = [Netlist(redrawn).shorted(-1, store_v=volts).module_a for volts in (0.0, FULL_V)]

    assert currents != pytest.approx(sound, rel=0.01)


def test_the_plus_of_every_cell_is_towards_the_diode() -> None:
    plus = Netlist(parts.PARTS).shorted(-1, store_v=0.0).through_a

    assert min(plus[name] for name in STORE) > 1.0


def test_no_part_of_the_power_stage_carries_more_than_it_may() -> None:
    drawn = Netlist(parts.PARTS)
    # A turned or shorted bridge at the supply's end, and the module's own voltage at 40 K.
    flows = [drawn.shorted(way, emf_v) for way in (1, -1) for emf_v in (-0.5, 0.5)]
    for flow in flows:
        for name, most_w in parts.POWER_W.items():
            assert flow.through_a[name] ** 2 * parts.number(name) <= most_w
        for name, most_a in parts.CURRENT_A.items():
            assert abs(flow.through_a.get(name, flow.module_a)) <= most_a
    peak = drawn.shorted(-1, emf_v=0.5, store_v=0.0)
    for name, most_a in parts.PEAK_A.items():
        assert abs(peak.through_a.get(name, peak.module_a)) <= most_a
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
