"""Tests trajectories of touches against finite differences: what contacts leave in the skin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from each_case import each
from thermal_reference import Stage, sharp, skin_surface

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.heat.contact import (
    ThermalContact,
    contact_temperature_c,
    skin_surface_c,
    thermal_contact,
)
from hapticvlm.rendering.heat.history import RATES, aged, flow_w_per_m2
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

LEAD_S = 0.25

ALUMINIUM = Thermal(167, 2700, 896)
METAL = thermal_contact(MATERIALS["metal"].thermal, 22.0)
WOOD = thermal_contact(MATERIALS["wood"].thermal, 22.0)
GLASS = thermal_contact(MATERIALS["glass"].thermal, 22.0)
FABRIC = thermal_contact(MATERIALS["fabric"].thermal, 22.0)
REAL = ThermalTrajectory(lead_s=0.0)  # what a real object would do
STATED_C = 0.05  # of which finite differences have 0.02 themselves


def largest_error_c(stages: list[Stage], until_s: float) -> float:
    """Largest error against finite differences, where these can be trusted, degC."""
    rows = skin_surface(stages, until_s)
    trajectory, computed_c, done = REAL, np.zeros(len(rows)), 0
    ends = [stage.begins_at for stage in stages[1:]] + [math.inf]
    for stage, end_s in zip(stages, ends, strict=True):
        if stage.contact is None:
            trajectory = trajectory.release(stage.begins_at)
        else:
            trajectory = trajectory.touch(stage.contact, stage.begins_at, stage.begins_at)
        while done < len(rows) and rows[done, 0] <= end_s:
            computed_c[done] = trajectory.skin_c(rows[done, 0])
            done += 1
    return float(np.abs(computed_c - rows[:, 1])[sharp(rows[:, 0], stages)].max())


@each(before=[FABRIC, WOOD, GLASS, METAL], after=[FABRIC, WOOD, GLASS, METAL])
def test_a_slide_to_another_material_stays_within_the_stated_error(
    before: ThermalContact, after: ThermalContact
) -> None:
    assert largest_error_c([Stage(0.0, before), Stage(1.0, after)], 6.0) < STATED_C


@each(lasted_s=[0.1, 1.0, 5.0], resistance=[0.0, 1e-4, 5e-4, 2.5e-3, 1e-2])
def test_the_stated_error_holds_for_every_resistance_and_duration(
    resistance: float, lasted_s: float
) -> None:
    before = thermal_contact(ALUMINIUM, 22.0, contact_resistance=resistance)
    after = replace(FABRIC, contact_resistance=resistance)

    assert largest_error_c([Stage(0.0, before), Stage(lasted_s, after)], lasted_s + 5.0) < STATED_C


@pytest.mark.parametrize("touched", [FABRIC, GLASS, METAL])
def test_a_released_hand_recovers_and_a_second_touch_starts_from_there(
    touched: ThermalContact,
) -> None:
    stages = [Stage(0.0, touched), Stage(1.0, None), Stage(2.0, touched)]
    assert largest_error_c(stages, 6.0) < STATED_C


def test_many_slides_cost_no_more_and_stay_within_the_stated_error() -> None:
    touched = [METAL, WOOD, GLASS, FABRIC, METAL, GLASS, WOOD, METAL]
    stages = [Stage(0.4 * turn, contact) for turn, contact in enumerate(touched)]
    assert largest_error_c(stages, 8.0) < STATED_C

    trajectory = REAL
    for stage in stages:
        trajectory = trajectory.touch(stage.contact, stage.begins_at, stage.begins_at)
    assert len(trajectory.past) == RATES.size


def test_a_slide_off_or_onto_thin_metal_stays_within_the_stated_error() -> None:
    sheet = thermal_contact(ALUMINIUM, 22.0, thickness_m=1e-3)
    assert largest_error_c([Stage(0.0, sheet), Stage(2.0, WOOD)], 6.0) < STATED_C
    assert largest_error_c([Stage(0.0, METAL), Stage(1.0, sheet)], 6.0) < STATED_C


def test_a_belief_that_changes_midway_changes_how_the_past_fades() -> None:
    slid = REAL.touch(METAL, "knife", 0.0).touch(FABRIC, "blob", 1.0)
    believed = slid.touch(GLASS, "blob", 1.5)

    assert believed == REAL.touch(METAL, "knife", 0.0).touch(GLASS, "blob", 1.0)


@pytest.mark.parametrize("resistance", [math.inf, 1e300, 1e9])
def test_what_does_not_touch_after_all_leaves_the_past_to_itself(resistance: float) -> None:
    metal = REAL.touch(METAL, "knife", 0.0)
    apart = metal.touch(replace(WOOD, contact_resistance=resistance), "handle", 1.0)

    for now in (1.0, 1.5, 10.0, 100.0):
        assert apart.skin_c(now) == pytest.approx(metal.release(1.0).skin_c(now), abs=0.02)


def test_a_past_is_gone_in_the_end() -> None:
    slid = REAL.touch(METAL, "knife", 0.0).touch(WOOD, "handle", 1.0)

    assert slid.skin_c(1e9) == pytest.approx(contact_temperature_c(WOOD), abs=0.01)
    assert slid.release(2.0).skin_c(1e9) == pytest.approx(32.0, abs=0.01)


def test_skin_does_not_jump_when_a_hand_slides_or_lets_go() -> None:
    metal = REAL.touch(METAL, "knife", 0.0)
    before_c = metal.skin_c(1.0)

    assert metal.touch(WOOD, "handle", 1.0).skin_c(1.0) == pytest.approx(before_c, abs=1e-9)
    assert metal.release(1.0).skin_c(1.0) == pytest.approx(before_c, abs=1e-9)


def test_an_approach_waits_where_contact_goes_on() -> None:
    near = ThermalTrajectory().approach(METAL, 1.0)
    touched = near.touch(METAL, "knife", 2.0)

    assert near.target_c(1.0) == near.target_c(2.0) == skin_surface_c(METAL, LEAD_S)
    assert touched.target_c(2.0) == near.target_c(2.0)
    assert touched.target_c(4.0) == skin_surface_c(METAL, 2.0 + LEAD_S) < near.target_c(2.0)


def test_the_plate_leads_the_skin_by_its_resistance_times_the_flow_of_heat() -> None:
    near = ThermalTrajectory(plate_resistance=4e-4).approach(METAL, 1.0)
    touched = near.touch(METAL, "knife", 2.0)
    slid = touched.touch(WOOD, "handle", 3.0)

    ahead_c = 4e-4 * flow_w_per_m2((), METAL, LEAD_S)
    assert near.target_c(1.0) == pytest.approx(near.skin_c(1.0) + ahead_c)
    assert ahead_c < -1.0
    assert touched.target_c(2.0) == near.target_c(1.0)
    ahead_c = 4e-4 * flow_w_per_m2(slid.past, WOOD, 0.5)
    assert slid.target_c(3.5) == pytest.approx(slid.skin_c(3.5) + ahead_c)
    again = touched.release(3.0).approach(METAL, 3.5)
    assert again.target_c(3.5) == pytest.approx(
        again.touch(METAL, "knife", 3.5).target_c(3.5), abs=0.5
    )
    assert near.approach(METAL, 1.5, leads=False).target_c(1.5) == 32.0


def test_a_contact_that_goes_on_does_not_begin_again() -> None:
    trajectory = ThermalTrajectory().touch(METAL, "knife", 1.0)

    assert trajectory.touch(METAL, "knife", 1.5) is trajectory
    believed = trajectory.touch(replace(METAL, surface_c=10.0), "knife", 1.5)
    assert believed.begun_at == trajectory.begun_at
    assert believed.past == ()


def test_taps_in_quick_succession_are_one_contact() -> None:
    held = tapped = ThermalTrajectory().touch(GLASS, "pane", 0.0)
    for lifted_at in (0.34, 0.74, 1.14):
        for late_s in (0.0, 0.02, 0.06):
            tapped = tapped.approach(GLASS, lifted_at + late_s)
        tapped = tapped.touch(GLASS, "pane", lifted_at + 0.08)

    assert tapped.past == ()
    assert tapped.target_c(2.0) == held.touch(GLASS, "pane", 2.0).target_c(2.0)


def test_a_longer_lift_ends_the_contact_when_the_hand_left() -> None:
    trajectory = ThermalTrajectory().touch(GLASS, "pane", 0.0)
    for now in (1.0, 1.1, 1.01 + 0.15):
        trajectory = trajectory.approach(GLASS, now)

    touched_c = ThermalTrajectory().touch(GLASS, "pane", 0.0).skin_c(1.0)
    assert trajectory.past_at == 1.0
    assert sum(trajectory.past) == pytest.approx(touched_c - GLASS.skin_c)
    assert trajectory.begun_at is None


def test_a_brief_lift_from_one_object_to_another_is_no_slide() -> None:
    trajectory = (
        ThermalTrajectory()
        .touch(GLASS, "pane", 0.0)
        .approach(GLASS, 1.0)
        .touch(GLASS, "other", 1.1)
    )

    assert trajectory.begun_at == 1.1 - LEAD_S
    assert trajectory.past == aged(
        ThermalTrajectory().touch(GLASS, "pane", 0.0).release(1.0).past, 1.1 - 1.0
    )


def test_an_unknown_material_is_neutral_and_leaves_nothing() -> None:
    trajectory = ThermalTrajectory().touch(None, "blob", 1.0)

    assert trajectory.target_c(3.0) == 32.0
    assert trajectory.release(3.0).past == ()


def test_what_becomes_known_during_a_touch_begins_with_its_lead() -> None:
    known = ThermalTrajectory().touch(None, "blob", 1.0).touch(METAL, "blob, seen", 1.3)

    assert known.begun_at == 1.3 - LEAD_S
    assert known.past == ()


def test_a_released_hand_wants_a_neutral_plate() -> None:
    assert ThermalTrajectory().touch(METAL, "knife", 0.0).release(2.0).target_c(2.0) == 32.0
    assert ThermalTrajectory().target_c(0.0) == 32.0


def test_gain_damps_or_exaggerates_the_deviation_from_neutral() -> None:
    trajectory = ThermalTrajectory().touch(METAL, "knife", 0.0)
    full_c = trajectory.target_c(1.0) - 32.0

    for gain in (0.0, 0.5, 2.0):
        assert trajectory.target_c(1.0, gain) - 32.0 == pytest.approx(gain * full_c)


def test_skin_warmer_than_neutral_is_where_the_course_starts() -> None:
    warm = replace(GLASS, skin_c=34.0)
    trajectory = REAL.touch(warm, "pane", 0.0)

    assert trajectory.skin_c(0.0) == 34.0
    assert trajectory.skin_c(1e9) == pytest.approx(contact_temperature_c(warm), abs=0.01)


@pytest.mark.parametrize("broken_c", [math.nan, math.inf])
def test_a_broken_contact_leaves_no_trace(broken_c: float) -> None:
    trajectory = ThermalTrajectory().touch(replace(METAL, surface_c=broken_c), "knife", 0.0)

    assert math.isfinite(trajectory.touch(WOOD, "handle", 1.0).target_c(1.5))


@pytest.mark.parametrize("now", [0.5, -1e9])
def test_a_clock_that_jumps_back_gives_a_number(now: float) -> None:
    trajectory = ThermalTrajectory().touch(METAL, "knife", 1.0).touch(WOOD, "handle", 2.0)

    assert 22.0 <= trajectory.target_c(now) <= 32.0
    assert 22.0 <= trajectory.release(now).skin_c(now) <= 32.0
