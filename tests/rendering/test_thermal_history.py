"""Tests the skin's memory against closed forms: kernel, inverse Laplace transform, tables."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from each_case import each

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.rendering.heat import history as thermal_history
from hapticvlm.rendering.heat.contact import (
    SKIN,
    ThermalContact,
    progress,
    share,
    thermal_contact,
)
from hapticvlm.rendering.heat.history import (
    RATES,
    after,
    aged,
    faded_c,
    fading,
    flow_w_per_m2,
    remaining_c,
)

GLASS = thermal_contact(MATERIALS["glass"].thermal, 22.0)
METAL = thermal_contact(MATERIALS["metal"].thermal, 22.0)
STEEL = thermal_contact(Thermal(15, 8000, 500), 22.0, contact_resistance=0.0)
EVEN = (1.0, *(0.0 for _ in RATES[1:]))  # one height, all but still


@each(elapsed_s=np.geomspace(1e-4, 100.0, 12))
def test_the_rates_give_the_kernel_of_the_skin(elapsed_s: float) -> None:
    value = thermal_history._WEIGHTS @ np.exp(-RATES * elapsed_s)
    stated = 4e-3 if elapsed_s < 10.0 else 1e-2
    assert value == pytest.approx(1.0 / math.sqrt(math.pi * elapsed_s), rel=stated)


@each(rate=[1e-3, 1.0, 1e3], elapsed_s=[1e-3, 1.0, 100.0])
def test_four_points_bring_an_exponential_back_from_laplace(elapsed_s: float, rate: float) -> None:
    s = thermal_history._CONTOUR / elapsed_s
    value = (thermal_history._CONTOUR_WEIGHTS / elapsed_s / (s + rate)).sum().real

    assert value == pytest.approx(math.exp(-rate * elapsed_s), abs=5e-5)


@pytest.mark.parametrize("elapsed_s", [0.01, 0.1, 1.0, 10.0])
def test_a_still_past_fades_as_skin_of_that_temperature_would(elapsed_s: float) -> None:
    table = fading(EVEN, GLASS)

    assert faded_c(table, elapsed_s) == pytest.approx(1.0 - share(GLASS, elapsed_s), abs=2e-3)


def test_a_perfect_contact_takes_its_share_at_once() -> None:
    taken = STEEL.thermal.effusivity / (STEEL.thermal.effusivity + SKIN.effusivity)

    assert faded_c(fading(EVEN, STEEL), 0.0) == pytest.approx(1.0 - taken)


def test_a_perfect_contact_leaves_what_the_closed_form_says() -> None:
    change_c = share(STEEL, 2.0) * -10.0
    past = after((), STEEL, 2.0, change_c)

    for since_s in (0.01, 0.1, 1.0, 10.0):
        left = change_c * 2.0 / math.pi * math.atan(math.sqrt(2.0 / since_s))
        assert remaining_c(past, since_s) == pytest.approx(left, abs=0.02)


def test_a_contact_that_gives_even_heat_leaves_what_the_closed_form_says() -> None:
    barely = thermal_contact(MATERIALS["metal"].thermal, 22.0, contact_resistance=1.0)
    change_c = share(barely, 1.0) * -10.0
    past = after((), barely, 1.0, change_c)

    for since_s in (0.01, 0.1, 1.0, 10.0):
        left = change_c * (math.sqrt(1.0 + since_s) - math.sqrt(since_s))
        assert remaining_c(past, since_s) == pytest.approx(left, rel=0.01)


@each(contact=[GLASS, METAL], elapsed_s=[1e-3, 0.01, 0.1, 1.0, 10.0])
def test_heat_flows_into_the_skin_as_the_closed_form_says(
    contact: ThermalContact, elapsed_s: float
) -> None:
    x = progress(contact, elapsed_s)
    expected = -10.0 / contact.contact_resistance * math.exp(x * x) * math.erfc(x)

    assert flow_w_per_m2((), contact, elapsed_s) == pytest.approx(expected, rel=2e-3)
    warmer = replace(contact, skin_c=contact.skin_c - 1.0)
    assert flow_w_per_m2(EVEN, warmer, elapsed_s) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    "change",
    [{"contact_resistance": 1e9}, {"contact_resistance": math.inf}, {"surface_c": math.nan}],
)
def test_no_heat_flows_where_nothing_touches_or_nobody_knows(change: dict[str, Any]) -> None:
    assert flow_w_per_m2((), replace(GLASS, **change), 1.0) == 0.0


def test_a_past_ages_in_any_number_of_steps() -> None:
    past = after((), GLASS, 1.0, share(GLASS, 1.0) * -10.0)

    assert aged(aged(past, 0.3), 0.7) == pytest.approx(aged(past, 1.0))
    assert sum(aged(past, 1.0)) == pytest.approx(remaining_c(past, 1.0))


def test_no_past_costs_nothing_and_shows_nothing() -> None:
    assert (fading((), GLASS), aged((), 1.0), remaining_c((), 1.0), faded_c((), 1.0)) == (
        (),
        (),
        0,
        0,
    )


@pytest.mark.parametrize("elapsed_s", [-1.0, 0.0, math.nan, 1e5, math.inf])
def test_any_time_has_a_finite_answer(elapsed_s: float) -> None:
    assert math.isfinite(faded_c(fading(EVEN, GLASS), elapsed_s))


def test_a_vanishing_sheet_leaves_the_past_alone() -> None:
    foil = thermal_contact(MATERIALS["metal"].thermal, 22.0, thickness_m=0.0)

    assert faded_c(fading(EVEN, foil), 1.0) == pytest.approx(1.0, abs=2e-3)
