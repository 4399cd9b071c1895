"""The contact model against a finite-difference slab and the tables; the limits one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.thermal import (
    DOSE_LIMIT_CEM43,
    HEAT_LIMIT_S,
    LEAD_S,
    SETPOINT_MAX_C,
    SETPOINT_MIN_C,
    SINK_TRIP_C,
    SKIN,
    PlateReading,
    ThermalContact,
    carries_cue,
    contact_temperature_c,
    limit,
    skin_surface_c,
    thermal_contact,
    wanted_c,
    within_range,
)

ALUMINIUM = Thermal(167, 2700, 896)
COPPER = Thermal(398, 8940, 385)
CALM = PlateReading(
    plate_c=32.0,
    sink_c=25.0,
    setpoint_c=32.0,
    duty=0.0,
    current_limited=False,
    dose_cem43=0.0,
    heated_s=0.0,
    faults=(),
)


def slab(contact: ThermalContact, thickness_m: float) -> NDArray[np.float64]:
    """Backward Euler over a slab on deep skin: rows of time and skin surface; knows no erfc."""
    skin_m = 5e-6 * 1.077 ** np.arange(80)
    slab_m = np.full(80, thickness_m / 80) if thickness_m < 0.05 else 5e-6 * 1.11 ** np.arange(80)
    cell_m = np.concatenate((skin_m[::-1], slab_m))
    conductivity = np.repeat([SKIN.conductivity, contact.thermal.conductivity], 80)
    heat = np.repeat(
        [
            SKIN.density * SKIN.heat_capacity,
            contact.thermal.density * contact.thermal.heat_capacity,
        ],
        80,
    )
    half = cell_m / 2 / conductivity
    between = half[:-1] + half[1:]
    between[79] += contact.contact_resistance
    link, capacity = 1 / between, cell_m * heat
    now_c = np.repeat([contact.skin_c, contact.surface_c], 80)
    time_s, step_s, rows = 0.0, 1e-5, []
    while time_s < 10.0:
        bands = np.zeros((3, 160))
        bands[1] = capacity / step_s
        bands[1, :-1] += link
        bands[1, 1:] += link
        bands[0, 1:] = bands[2, :-1] = -link
        now_c = solve_banded((1, 1), bands, capacity / step_s * now_c)
        time_s += step_s
        rows.append((time_s, now_c[79] - (now_c[79] - now_c[80]) * link[79] * half[79]))
        step_s = min(step_s * 1.05, 0.02 * time_s + 1e-5)
    return np.array(rows)


def largest_difference_c(contact: ThermalContact, rows: NDArray[np.float64]) -> float:
    late = rows[rows[:, 0] > 0.01]
    model_c = [skin_surface_c(contact, elapsed_s) for elapsed_s in late[:, 0]]
    return float(np.abs(model_c - late[:, 1]).max())


@pytest.mark.parametrize("name", ["wood", "glass", "fabric", "metal", "stone"])
def test_a_thick_object_follows_the_finite_difference_solution(name: str) -> None:
    contact = thermal_contact(MATERIALS[name].thermal, 22.0)

    assert largest_difference_c(contact, slab(contact, 1.0)) < 0.05


@pytest.mark.parametrize(
    ("thermal", "thickness_m"),
    [
        (ALUMINIUM, 0.001),
        (ALUMINIUM, 0.005),
        (MATERIALS["metal"].thermal, 0.001),
        (MATERIALS["metal"].thermal, 0.005),
        (MATERIALS["glass"].thermal, 0.002),
        (MATERIALS["wood"].thermal, 0.005),
    ],
)
def test_a_sheet_stays_within_its_stated_error_of_the_finite_difference_slab(
    thermal: Thermal, thickness_m: float
) -> None:
    contact = thermal_contact(thermal, 22.0, thickness_m=thickness_m)

    assert largest_difference_c(contact, slab(contact, thickness_m)) < 0.4


def test_thin_aluminium_is_a_lump_almost_exactly() -> None:
    contact = thermal_contact(ALUMINIUM, 22.0, thickness_m=0.001)

    assert largest_difference_c(contact, slab(contact, 0.001)) < 0.06


def test_thin_metal_gives_out_where_thick_metal_does_not() -> None:
    thin = thermal_contact(ALUMINIUM, 22.0, thickness_m=0.001)
    thick = thermal_contact(ALUMINIUM, 22.0)

    assert skin_surface_c(thin, 0.02) == pytest.approx(skin_surface_c(thick, 0.02), abs=0.1)
    assert skin_surface_c(thin, 10.0) > skin_surface_c(thick, 10.0) + 2.0
    assert skin_surface_c(thin, 1e9) == pytest.approx(32.0, abs=0.01)


def test_a_very_thick_slab_is_semi_infinite() -> None:
    for thermal in (ALUMINIUM, MATERIALS["wood"].thermal):
        thick = thermal_contact(thermal, 5.0)
        slab_contact = thermal_contact(thermal, 5.0, thickness_m=10.0)
        for elapsed_s in (0.0, 0.1, 1.0, 10.0):
            assert skin_surface_c(slab_contact, elapsed_s) == skin_surface_c(thick, elapsed_s)


@pytest.mark.parametrize(
    ("thermal", "at_23", "at_45", "at_5"),
    [
        (MATERIALS["fabric"].thermal, 31.8, 34.4, 29.7),
        (MATERIALS["wood"].thermal, 30.6, 35.9, 26.2),
        (MATERIALS["leather"].thermal, 30.2, 36.4, 25.1),
        (MATERIALS["rubber"].thermal, 29.7, 36.9, 23.8),
        (MATERIALS["glass"].thermal, 27.5, 39.6, 17.6),
        (MATERIALS["stone"].thermal, 26.3, 41.1, 14.1),
        (MATERIALS["metal"].thermal, 24.3, 43.4, 8.7),
        (ALUMINIUM, 23.6, 44.3, 6.6),
        (COPPER, 23.3, 44.6, 5.9),
    ],
)
def test_contact_temperatures_are_those_of_the_reference_table(
    thermal: Thermal, at_23: float, at_45: float, at_5: float
) -> None:
    for surface_c, expected_c in ((23.0, at_23), (45.0, at_45), (5.0, at_5)):
        contact = thermal_contact(thermal, surface_c, skin_c=33.0)
        assert contact_temperature_c(contact) == pytest.approx(expected_c, abs=0.1)


def test_the_transient_has_the_published_size_one_second_in() -> None:
    # Physics reference 2.3: skin -4.5 degC for glass and -6.8 for aluminium at 5e-4 m2 K/W.
    for thermal, fall_c in ((MATERIALS["glass"].thermal, 4.5), (ALUMINIUM, 6.8)):
        contact = thermal_contact(thermal, 23.0, contact_resistance=5e-4, skin_c=33.0)
        assert 33.0 - skin_surface_c(contact, 1.0) == pytest.approx(fall_c, abs=0.1)


def test_materials_keep_their_order_at_every_moment() -> None:
    order = ("fabric", "wood", "plastic", "glass", "metal")
    contacts = [thermal_contact(MATERIALS[name].thermal, 22.0) for name in order]

    temperatures = [contact_temperature_c(contact) for contact in contacts]
    assert temperatures == sorted(temperatures, reverse=True)
    for elapsed_s in (0.05, 0.25, 1.0, 5.0, 60.0):
        surfaces = [skin_surface_c(contact, elapsed_s) for contact in contacts]
        assert surfaces == sorted(surfaces, reverse=True)


@pytest.mark.parametrize("thickness_m", [None, 0.0005, 0.01])
def test_a_vanishing_contact_resistance_tends_to_none(thickness_m: float | None) -> None:
    none = thermal_contact(ALUMINIUM, 10.0, thickness_m=thickness_m, contact_resistance=0.0)

    for resistance in (1e-9, 1e-12, 1e-300):
        tiny = replace(none, contact_resistance=resistance)
        for elapsed_s in (0.01, 1.0, 100.0):
            expected_c = skin_surface_c(none, elapsed_s)
            assert skin_surface_c(tiny, elapsed_s) == pytest.approx(expected_c, abs=0.01)
    thick = replace(none, thickness_m=None)
    assert skin_surface_c(thick, 0.0) == contact_temperature_c(thick)


def test_nothing_overflows_where_exp_times_erfc_would() -> None:
    for resistance in (1e-3, 1e-4, 1e-5, 1e-9, 0.0):
        for thickness_m in (None, 1e-6, 1e-3, 0.1):
            for thermal in (ALUMINIUM, MATERIALS["glass"].thermal, MATERIALS["fabric"].thermal):
                contact = thermal_contact(
                    thermal, 60.0, thickness_m=thickness_m, contact_resistance=resistance
                )
                for elapsed_s in (0.0, 0.011, 0.09, 1.1, 9.2, 1e6, 1e300, math.inf):
                    skin_c = skin_surface_c(contact, elapsed_s)
                    assert 32.0 - 1e-9 <= skin_c <= 60.0 + 1e-9


def test_equal_roots_of_the_lump_do_not_divide_by_zero() -> None:
    resistance = 5e-4
    capacity = 4.0 * SKIN.effusivity**2 * resistance
    contact = thermal_contact(Thermal(1e6, capacity, 1.0), 22.0, thickness_m=1.0)
    exact = replace(contact, contact_resistance=resistance, thickness_m=1.0)
    beside = replace(exact, thickness_m=1.001)

    assert skin_surface_c(exact, 1.0) == pytest.approx(skin_surface_c(beside, 1.0), abs=0.01)


def test_before_contact_the_skin_is_as_it_was() -> None:
    contact = thermal_contact(ALUMINIUM, 5.0, skin_c=31.0)

    assert skin_surface_c(contact, 0.0) == 31.0
    assert skin_surface_c(contact, -1.0) == 31.0
    assert skin_surface_c(contact, math.nan) == 31.0


def test_the_default_contact_resistance_is_the_fit_of_ho_and_jones() -> None:
    assert thermal_contact(COPPER, 20.0).contact_resistance == pytest.approx(5.4e-4, rel=0.02)
    glass = thermal_contact(MATERIALS["glass"].thermal, 20.0)
    assert glass.contact_resistance == pytest.approx(7.3e-4, rel=0.02)


def test_an_approach_passes_into_contact_without_a_step() -> None:
    contact = thermal_contact(MATERIALS["metal"].thermal, 22.0)

    assert wanted_c(contact, None) == skin_surface_c(contact, LEAD_S)
    assert wanted_c(contact, 0.0) == wanted_c(contact, None)
    assert wanted_c(contact, LEAD_S) == wanted_c(contact, None)
    assert wanted_c(contact, 2.0) == skin_surface_c(contact, 2.0) < wanted_c(contact, 0.0)


def test_gain_scales_the_deviation_from_neutral() -> None:
    contact = thermal_contact(MATERIALS["metal"].thermal, 22.0)

    full_c = wanted_c(contact, 1.0) - 32.0
    assert wanted_c(contact, 1.0, gain=0.5) - 32.0 == pytest.approx(full_c / 2)
    assert wanted_c(contact, 1.0, gain=0.0) == 32.0


def test_an_object_at_skin_temperature_carries_no_cue() -> None:
    metal, fabric = MATERIALS["metal"].thermal, MATERIALS["fabric"].thermal

    assert carries_cue(thermal_contact(metal, 22.0))
    assert not carries_cue(thermal_contact(metal, 32.1))
    assert not carries_cue(thermal_contact(fabric, 31.0))
    assert carries_cue(thermal_contact(fabric, 45.0))


@pytest.mark.parametrize(
    ("unlimited_c", "setpoint_c", "limited_by"),
    [
        (25.0, 25.0, None),
        (18.0, 18.0, None),
        (59.0, SETPOINT_MAX_C, "setpoint"),
        (5.9, SETPOINT_MIN_C, "setpoint"),
    ],
)
def test_the_band_limits_and_keeps_the_wish(
    unlimited_c: float, setpoint_c: float, limited_by: str | None
) -> None:
    limited = within_range(unlimited_c)

    assert limited.setpoint_c == setpoint_c
    assert limited.unlimited_c == unlimited_c
    assert limited.limited_by == limited_by


@pytest.mark.parametrize("wish", [math.nan, math.inf, -math.inf])
def test_what_is_no_temperature_becomes_neutral(wish: float) -> None:
    assert within_range(wish).setpoint_c == 32.0
    assert math.isfinite(within_range(wish).unlimited_c)
    assert limit(wish, 32.0, 0.02, CALM).setpoint_c == 32.0
    assert limit(25.0, wish, 0.02, CALM).setpoint_c == pytest.approx(31.9)


def test_nothing_limits_a_wish_that_is_already_there() -> None:
    assert limit(25.0, 25.0, 0.02, CALM).limited_by is None


def test_the_setpoint_band_is_named() -> None:
    limited = limit(59.0, 40.0, 0.02, CALM)

    assert (limited.setpoint_c, limited.limited_by, limited.unlimited_c) == (40.0, "setpoint", 59.0)


@pytest.mark.parametrize("wish_c", [20.0, 39.0])
def test_the_setpoint_moves_five_degrees_a_second(wish_c: float) -> None:
    setpoint_c, names = 32.0, set()
    for _ in range(50):
        limited = limit(wish_c, setpoint_c, 0.02, CALM)
        setpoint_c = limited.setpoint_c
        names.add(limited.limited_by)

    assert setpoint_c == pytest.approx(32.0 + math.copysign(5.0, wish_c - 32.0))
    assert names == {"slew"}


@pytest.mark.parametrize("elapsed_s", [60.0, math.inf])
def test_a_stalled_caller_earns_no_leap(elapsed_s: float) -> None:
    assert limit(20.0, 32.0, elapsed_s, CALM).setpoint_c == pytest.approx(31.5)


@pytest.mark.parametrize("elapsed_s", [0.0, -5.0, math.nan])
def test_no_time_no_movement(elapsed_s: float) -> None:
    assert limit(20.0, 32.0, elapsed_s, CALM).setpoint_c == 32.0


@pytest.mark.parametrize(
    "tired",
    [replace(CALM, dose_cem43=DOSE_LIMIT_CEM43), replace(CALM, heated_s=HEAT_LIMIT_S)],
)
def test_used_up_heat_allows_neutral_and_cold_only(tired: PlateReading) -> None:
    assert limit(38.0, 32.0, 0.02, tired).limited_by == "dose"
    assert limit(38.0, 32.0, 0.02, tired).setpoint_c == 32.0
    assert limit(25.0, 25.0, 0.02, tired).limited_by is None


def test_a_hot_sink_takes_the_cold_away_by_degrees() -> None:
    def coldest_c(sink_c: float | None) -> float:
        setpoint_c = 18.0
        for _ in range(200):
            reading = replace(CALM, sink_c=sink_c)
            setpoint_c = limit(18.0, setpoint_c, 0.02, reading).setpoint_c
        return setpoint_c

    assert coldest_c(25.0) == 18.0
    assert coldest_c(50.0) == pytest.approx(25.0)
    assert coldest_c(SINK_TRIP_C) == 32.0
    assert coldest_c(None) == 32.0
    assert limit(18.0, 25.0, 0.02, replace(CALM, sink_c=50.0)).limited_by == "sink"


def test_a_hot_sink_does_not_forbid_heat() -> None:
    assert limit(38.0, 38.0, 0.02, replace(CALM, sink_c=54.0)).limited_by is None


def test_a_plate_at_its_current_limit_is_named_when_nothing_else_is() -> None:
    weak = replace(CALM, current_limited=True)

    assert limit(20.0, 20.0, 0.02, weak).limited_by == "current"
    assert limit(20.0, 20.0, 0.02, weak).setpoint_c == 20.0
    assert limit(20.0, 32.0, 0.02, weak).limited_by == "slew"
