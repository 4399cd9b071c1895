"""Tests the limits of the plate one by one, with NaN and with a stalled caller."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from each_case import each
from word_tables import cases

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.heat.contact import strength
from hapticvlm.rendering.heat.limits import (
    Delay,
    Limited,
    PlateReading,
    Strongest,
    limit,
    limits_of,
    settle_material,
    within_range,
)

CALM = PlateReading(plate_c=32.0, sink_c=25.0, setpoint_c=32.0)
TABLES = Path(__file__).with_name("plate_limits.json")


@pytest.mark.parametrize(
    ("unlimited_c", "setpoint_c", "limited_by"),
    [
        (25.0, 25.0, None),
        (18.0, 18.0, None),
        (59.0, 40.0, "setpoint"),
        (5.9, 18.0, "setpoint"),
    ],
)
def test_the_band_limits_and_keeps_the_wish(
    unlimited_c: float, setpoint_c: float, limited_by: str | None
) -> None:
    limited = within_range(unlimited_c)

    assert limited.setpoint_c == setpoint_c
    assert limited.unlimited_c == unlimited_c
    assert limited.limited_by == limited_by


@pytest.mark.parametrize("setpoint_c", [math.nan, math.inf, -math.inf])
def test_what_is_no_temperature_becomes_neutral(setpoint_c: float) -> None:
    assert within_range(setpoint_c).setpoint_c == 32.0
    assert math.isfinite(within_range(setpoint_c).unlimited_c)
    assert limit(setpoint_c, 32.0, 0.02, CALM).setpoint_c == 32.0
    assert limit(25.0, setpoint_c, 0.02, CALM).setpoint_c == pytest.approx(31.76)


@pytest.mark.parametrize(("wish_c", "after_half_s_c"), [(18.0, 26.0), (39.0, 38.0)])
def test_the_setpoint_moves_by_twelve_degrees_a_second(
    wish_c: float, after_half_s_c: float
) -> None:
    setpoint_c, names = 32.0, set()
    for _ in range(25):
        limited = limit(wish_c, setpoint_c, 0.02, CALM)
        setpoint_c = limited.setpoint_c
        names.add(limited.limited_by)

    assert setpoint_c == pytest.approx(after_half_s_c)
    assert names == {"slew"}


def test_a_hot_sink_takes_the_cold_away_by_degrees() -> None:
    def coldest_c(sink_c: float | None) -> float:
        setpoint_c = 18.0
        for _ in range(200):
            reading = replace(CALM, sink_c=sink_c)
            setpoint_c = limit(18.0, setpoint_c, 0.02, reading).setpoint_c
        return setpoint_c

    assert coldest_c(25.0) == 18.0
    assert coldest_c(41.0) == pytest.approx(25.0)
    assert coldest_c(44.0) == 32.0
    assert coldest_c(None) == 32.0
    assert limit(18.0, 25.0, 0.02, replace(CALM, sink_c=41.0)).limited_by == "sink"


@each(case=cases(TABLES, "limits"))
def test_each_wish_is_limited_as_the_table_says_and_the_limit_is_named(case: list[Any]) -> None:
    _, wish_c, setpoint_c, elapsed_s, reading, limited_c, named = case
    limited = limit(wish_c, setpoint_c, elapsed_s, replace(CALM, **reading))
    assert limited.setpoint_c == pytest.approx(limited_c)
    assert limited.limited_by == named
    assert limited.unlimited_c == wish_c


@each(case=cases(TABLES, "strongest"))
def test_the_strongest_material_moves_as_the_table_says_and_its_limit_is_named(
    case: list[Any],
) -> None:
    _, from_c, wish_c, share, elapsed_s, reading, *expected = case
    before = Strongest(from_c, from_c)
    after = before.towards(wish_c, share, elapsed_s, replace(CALM, **reading))
    assert [after.plate_c, after.setpoint_c] == pytest.approx(expected[:2])
    assert after.limited_by == expected[2]


STRENGTHS = [strength(MATERIALS[name].thermal) for name in ("fabric", "wood", "glass", "metal")]


def settled_c(object_c: float, share: float) -> float:
    """Setpoint in the end for a material of this strength, which wishes its share of 90 %."""
    wish_c = 32.0 + 0.9 * share * (object_c - 32.0)
    return settle_material(wish_c, share, limits_of(CALM)).setpoint_c


def test_materials_and_temperatures_keep_their_order_beyond_the_limits() -> None:
    for object_c in (-20.0, 5.0, 10.0, 45.0, 60.0, 90.0):
        from_neutral = [abs(settled_c(object_c, share) - 32.0) for share in STRENGTHS]
        gaps = [later / former for former, later in itertools.pairwise(from_neutral)]
        assert min(gaps) > 1.1, object_c
    for share in STRENGTHS:
        setpoints_c = [settled_c(float(object_c), share) for object_c in range(-20, 91)]
        steps_c = [later - former for former, later in itertools.pairwise(setpoints_c)]
        assert all(0.0 <= step_c < 1.0 for step_c in steps_c), share


def test_nothing_is_compressed_where_no_limit_binds_metal() -> None:
    for share in STRENGTHS:
        for object_c in (20.0, 40.0):
            wish_c = 32.0 + 0.9 * share * (object_c - 32.0)
            assert settle_material(wish_c, share, limits_of(CALM)).setpoint_c == wish_c


def course(wish_c: float, share: float, seconds: float) -> list[Limited]:
    """The setpoints of a lead towards this wish, each 20 ms."""
    strongest, limited, courses = Strongest(), limit(32.0, 32.0, 0.02, CALM), []
    for _ in range(round(seconds / 0.02)):
        strongest = strongest.towards(wish_c, share, 0.02, CALM)
        limited = limit(wish_c, limited.setpoint_c, 0.02, CALM, strength=share, strongest=strongest)
        courses.append(limited)
    return courses


def test_on_the_way_to_a_limit_materials_are_apart_and_the_limit_is_named() -> None:
    metal, glass = (course(32.0 - 25.0 * share, share, 3.0) for share in (1.0, STRENGTHS[2]))

    assert glass[50].limited_by == "current"
    assert metal[50].setpoint_c < glass[50].setpoint_c - 1.5
    assert (glass[-1].limited_by, glass[-1].unlimited_c) == ("setpoint", 32.0 - 25.0 * STRENGTHS[2])
    assert glass[-1].setpoint_c == pytest.approx(32.0 - 14.0 * STRENGTHS[2] ** 0.5)
    steps_c = [later.setpoint_c - former.setpoint_c for former, later in itertools.pairwise(glass)]
    assert max(map(abs, steps_c)) <= 0.24 + 1e-9


@pytest.mark.parametrize("lag_s", [0.0, 0.3, 1.0])
def test_a_face_is_behind_its_wish_by_its_own_way_and_not_by_the_lag_of_its_beads(
    lag_s: float,
) -> None:
    moved, arrived = (delay_after_1_s(lag_s, face_c) for face_c in (32.0, 24.0))

    assert moved.behind_c == pytest.approx(8.0 * (1.0 - math.exp(-1.0 / 0.7)), rel=0.05)
    assert arrived.behind_c == pytest.approx(0.0, abs=0.2)


@each(case=cases(TABLES, "delays"))
def test_each_reading_changes_the_delay_as_the_table_says(case: list[Any]) -> None:
    _, behind_c, before_c, plate_c, elapsed_s, lag_s, expected_c = case
    reading = replace(CALM, plate_c=plate_c, lag_s=lag_s)
    after = Delay(behind_c, before_c).after(24.0, elapsed_s, reading)
    assert after.behind_c == pytest.approx(expected_c)


def delay_after_1_s(lag_s: float, face_c: float) -> Delay:
    """The delay of a face that stands at `face_c` from contact on, of which 24 degC are wished."""
    bead_c, delay = 32.0, Delay()
    for _ in range(50):
        delay = delay.after(24.0, 0.02, replace(CALM, plate_c=bead_c, lag_s=lag_s))
        bead_c += (face_c - bead_c) * min(0.02 / lag_s if lag_s else 1.0, 1.0)
    return delay
