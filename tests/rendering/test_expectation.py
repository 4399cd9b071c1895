"""Tests that an uncertain material is rendered as the expectation over the beliefs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.expectation import expected_thermal, nearest_vibration, needed_belief
from hapticvlm.rendering.heat.contact import contact_temperature_c, thermal_contact

beliefs = st.dictionaries(st.sampled_from(sorted(MATERIALS)), st.floats(1e-3, 1.0), min_size=1)


def contact_c(thermal, surface_c=22.0) -> float:
    return contact_temperature_c(thermal_contact(thermal, surface_c))


@given(beliefs, st.floats(-20.0, 80.0))
def test_the_contact_temperature_is_the_mean_over_the_beliefs(shares, surface_c) -> None:
    total = sum(shares.values())
    mean = sum(p / total * contact_c(MATERIALS[n].thermal, surface_c) for n, p in shares.items())
    assert contact_c(expected_thermal(shares, MATERIALS), surface_c) == pytest.approx(
        mean, abs=1e-6
    )


def test_a_sure_belief_is_the_material_itself() -> None:
    for name, material in MATERIALS.items():
        expected = expected_thermal({name: 0.4}, MATERIALS)
        assert expected.conductivity == pytest.approx(material.thermal.conductivity)
        assert nearest_vibration({name: 0.4}, MATERIALS) == name


def test_a_graded_vibration_is_of_what_lies_between() -> None:
    between = nearest_vibration({"stone": 0.35, "ceramic": 0.3, "glass": 0.35}, MATERIALS)
    assert between == "ceramic"


@given(beliefs)
def test_a_graded_vibration_is_of_something_believed(shares) -> None:
    assert nearest_vibration(shares, MATERIALS) in shares


def test_what_startles_takes_more_belief() -> None:
    assert needed_belief("slide", 0.0) == pytest.approx(1 / 2)
    assert needed_belief("strike", 0.0) == pytest.approx(2 / 3)
    assert needed_belief("slide", -3.5) == pytest.approx(2 / 3)
    assert needed_belief("strike", 8.0) == pytest.approx(4 / 5)
