"""The plate of one resistor: its firmware, its faults and its page, firmware/ONE_RESISTOR.md."""

from __future__ import annotations

import re

import pytest
from tiers import nightly_except

from hapticvlm.devices.plate.protocol import ONE_RESISTOR_MA
from hapticvlm.devices.simulated.plant import SEEBECK, Plant

from .board import Build
from .build import FIRMWARE, Chip
from .faults import BY_NAME
from .hardware import ONE_SCALE_A, ONE_STRONGEST, Driver, Limiter, Skin, one_resistor
from .rawhost import RawHost
from .situations import HELD_COLD, HELD_HOT, HOT, PRESSED, Situation, hold_for_a_minute
from .test_beads import felt_shares
from .trials import trial

BUILD = Build(0.3, has_one_resistor=True)
PAGE = (FIRMWARE / "ONE_RESISTOR.md").read_text()
STUCK_S = 900.0


def test_its_firmware_asks_for_what_its_resistor_lets_pass(chip: Chip) -> None:
    board = chip.board(build=BUILD)
    host = RawHost(board)
    host.greet()
    reply = host.greetings[0]
    board.close()

    assert {int.from_bytes(reply[at : at + 2], "little") for at in (21, 23)} == {ONE_RESISTOR_MA}
    assert ONE_SCALE_A * 1000.0 == ONE_RESISTOR_MA
    assert one_resistor().current_a(1.0) == pytest.approx(ONE_SCALE_A, rel=0.02)


# The sweep tries every fault on it: `sweep.py --one-resistor`. These are the worst of them.
@pytest.mark.parametrize(
    ("names", "situation"),
    nightly_except(
        5,
        [
            (("bridge shorted to heat",), HOT),
            (("bridge shorted to heat",), HELD_HOT),
            (("bridge shorted to cool",), HELD_COLD),
            (("RT4 off", "bridge shorted to heat"), HELD_HOT),
            (("both frozen alike", "bridge shorted to cool"), HELD_COLD),
        ],
    ),
)
def test_a_fault_leaves_the_skin_safe_without_a_comparator(
    chip: Chip, names: tuple[str, ...], situation: Situation
) -> None:
    outcome = trial(chip, [BY_NAME[name] for name in names], situation, 100.0, BUILD)

    assert outcome.is_safe, outcome
    assert outcome.numbers, "the firmware alone opens the relay, and names the fault"


@pytest.mark.parametrize(
    ("material", "surface_c"),
    nightly_except(4, [("glass", 22.0), ("metal", 22.0), ("wood", 22.0), ("metal", 40.0)]),
)
def test_the_page_says_how_much_of_a_thing_is_felt(
    chip: Chip, material: str, surface_c: float
) -> None:
    (row,) = re.findall(rf"\| {material}, {surface_c:g} degC \| (.+?) \|", PAGE)
    told = [float(part) for part in row.split("/")]
    felt = felt_shares(chip, material, BUILD, (0.25, 1.0, 3.0), surface_c)

    assert [100.0 * share for share in felt] == pytest.approx(told, abs=1.0)


@pytest.mark.parametrize("ohm", nightly_except(3, [10.0, 6.2, 8.2]))
def test_the_page_says_what_a_stuck_bridge_does_without_a_cut_out(ohm: float) -> None:
    (row,) = re.findall(rf"\| {ohm:g} ohm \| (.+) \|", PAGE)
    told = [float(number) for number in re.findall(r"[0-9.]+", row)]
    found = [
        stuck_c(ohm, way, room_c, strongest)
        for way, room_c in ((-1, 15.0), (1, 23.0), (1, 30.0), (1, 35.0))
        for strongest in (1.0, ONE_STRONGEST)
    ]

    assert found == pytest.approx(told, abs=0.1)


def stuck_c(ohm: float, way: int, room_c: float, strongest: float) -> float:
    """Hold a plate at its extreme for a minute, short its bridge; return the skin's extreme."""
    start_c = 40.0 if way > 0 else 18.0
    plant = Plant(room_c, palm_resistance=PRESSED, plate_c=32.0)
    hold_for_a_minute(plant, start_c, -ONE_SCALE_A, ONE_SCALE_A)
    driver = Driver(shorted=way, limiter=Limiter(series_ohm=ohm), has_one_resistor=True)
    skin = Skin()
    for _ in range(round(STUCK_S / 0.2)):
        emf_v = SEEBECK * (plant.plate_c - plant.sink_c)
        plant.step(driver.current_a(0.0, emf_v) / ONE_STRONGEST * strongest, 0.2)
        skin.feel(plant.skin_c, 0.2)
    return skin.highest_c if way > 0 else skin.lowest_c
