"""Tests the contact model against closed forms, finite differences and the tables."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mpmath
import pytest
from each_case import each, each_row
from word_tables import words

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.heat.contact import (
    SKIN,
    ThermalContact,
    carries_cue,
    contact_temperature_c,
    share,
    skin_surface_c,
    thermal_contact,
)

ALUMINIUM = Thermal(167, 2700, 896)
COPPER = Thermal(398, 8940, 385)
OVEN_DRY_WOOD = Thermal(0.16, 720, 1255)  # the table's own is at room moisture
TWELVE = {name: material.thermal for name, material in MATERIALS.items()} | {"copper": COPPER}
REFERENCE = Path(__file__).with_name("contact_temperatures.csv")
RESISTANCES = (0.0, 1e-5, 1e-4, 5e-4, 2.5e-3, 1e-2)  # m2 K/W
MOMENTS = tuple(10.0 ** (power / 4) for power in range(-12, 9))  # 1 ms to 100 s


def exact_share(contact: ThermalContact, elapsed_s: float) -> float:
    """exp(x^2) erfc(x) with enough digits that it neither overflows nor cancels."""
    with mpmath.workdps(60):
        skin, bulk = mpmath.mpf(SKIN.effusivity), mpmath.mpf(contact.thermal.effusivity)
        settled = bulk / (skin + bulk)
        if contact.contact_resistance == 0.0:
            return float(settled)
        x = mpmath.sqrt(elapsed_s) * (1 / skin + 1 / bulk) / contact.contact_resistance
        return float(settled * (1 - mpmath.exp(x * x) * mpmath.erfc(x)))


def exact_sheet_share(contact: ThermalContact, elapsed_s: float) -> float:
    """The sheet's Laplace transform inverted on Talbot's contour with 25 digits."""
    bulk, thickness_m = contact.thermal, contact.thickness_m
    diffusivity = bulk.conductivity / (bulk.density * bulk.heat_capacity)

    def transform(s: mpmath.mpc) -> mpmath.mpc:
        root = mpmath.sqrt(s)
        behind = mpmath.coth(thickness_m * root / math.sqrt(diffusivity)) / bulk.effusivity
        rest = contact.contact_resistance * root + behind
        return 1 / (1 + SKIN.effusivity * rest) / s

    with mpmath.workdps(25):
        return float(mpmath.invertlaplace(transform, elapsed_s, method="talbot"))


@each(name=TWELVE)
def test_the_closed_form_is_exact_to_a_millionth_of_a_degree(name: str) -> None:
    for resistance in RESISTANCES:
        contact = thermal_contact(TWELVE[name], 22.0, contact_resistance=resistance)
        for elapsed_s in MOMENTS:
            skin_c = skin_surface_c(contact, elapsed_s)
            exact_c = 32.0 - 10.0 * exact_share(contact, elapsed_s)
            assert abs(skin_c - exact_c) < 1e-6, (resistance, elapsed_s)


@each(thickness_m=[3e-4, 1e-3, 5e-3, 2e-2], name=["fabric", "wood", "glass", "metal", "copper"])
def test_a_sheet_is_exact_to_some_thousandths_of_a_degree(name: str, thickness_m: float) -> None:
    for resistance in (0.0, 1e-4, 5e-4, 1e-2):
        contact = thermal_contact(
            TWELVE[name], 22.0, thickness_m=thickness_m, contact_resistance=resistance
        )
        for elapsed_s in (1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0):
            off = share(contact, elapsed_s) - exact_sheet_share(contact, elapsed_s)
            assert abs(10.0 * off) < 4e-3, (resistance, elapsed_s)


def test_a_very_thick_slab_is_semi_infinite() -> None:
    for thermal in (ALUMINIUM, MATERIALS["wood"].thermal):
        thick = thermal_contact(thermal, 5.0)
        slab_contact = thermal_contact(thermal, 5.0, thickness_m=10.0)
        for elapsed_s in (0.0, 0.1, 1.0, 10.0):
            thick_c = skin_surface_c(thick, elapsed_s)
            assert skin_surface_c(slab_contact, elapsed_s) == pytest.approx(thick_c, abs=0.01)


@each_row(("name", "at_23", "at_45", "at_5"), words(REFERENCE, "contact"))
def test_contact_temperatures_are_those_of_the_reference_table(
    name: str, at_23: str, at_45: str, at_5: str
) -> None:
    bulk = {**TWELVE, "aluminium": ALUMINIUM, "oven-dry wood": OVEN_DRY_WOOD}[name]
    for surface_c, expected_c in ((23.0, at_23), (45.0, at_45), (5.0, at_5)):
        contact = thermal_contact(bulk, surface_c, skin_c=33.0)
        assert contact_temperature_c(contact) == pytest.approx(float(expected_c), abs=0.1)


def test_the_transient_has_the_published_size_one_second_in() -> None:
    # docs/physics.md 2.2: skin -4.5 degC for glass and -6.8 for aluminium at 5e-4 m2 K/W.
    for thermal, fall_c in ((MATERIALS["glass"].thermal, 4.5), (ALUMINIUM, 6.8)):
        contact = thermal_contact(thermal, 23.0, contact_resistance=5e-4, skin_c=33.0)
        assert 33.0 - skin_surface_c(contact, 1.0) == pytest.approx(fall_c, abs=0.1)


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


@pytest.mark.parametrize("thickness_m", [None, 0.0, 1e-300, 1e-3])
def test_an_infinite_contact_resistance_is_no_contact(thickness_m: float | None) -> None:
    apart = thermal_contact(ALUMINIUM, 5.0, thickness_m=thickness_m, contact_resistance=math.inf)

    for elapsed_s in (0.0, 1e-3, 100.0, math.inf):
        assert skin_surface_c(apart, elapsed_s) == 32.0


def test_before_contact_the_skin_is_as_it_was() -> None:
    contact = thermal_contact(ALUMINIUM, 5.0, skin_c=31.0)

    assert skin_surface_c(contact, 0.0) == 31.0
    assert skin_surface_c(contact, -1.0) == 31.0
    assert skin_surface_c(contact, math.nan) == 31.0


def test_the_default_contact_resistance_is_the_fit_of_ho_and_jones() -> None:
    assert thermal_contact(COPPER, 20.0).contact_resistance == pytest.approx(5.4e-4, rel=0.02)
    glass = thermal_contact(MATERIALS["glass"].thermal, 20.0)
    assert glass.contact_resistance == pytest.approx(7.3e-4, rel=0.02)


def test_an_object_at_skin_temperature_carries_no_cue() -> None:
    metal, fabric = MATERIALS["metal"].thermal, MATERIALS["fabric"].thermal

    assert carries_cue(thermal_contact(metal, 22.0))
    assert not carries_cue(thermal_contact(metal, 32.1))
    assert not carries_cue(thermal_contact(fabric, 31.0))
    assert carries_cue(thermal_contact(fabric, 45.0))
