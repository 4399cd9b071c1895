"""Tests that an uncertain material is rendered as the one that errs least on average."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hapticvlm.materials import MATERIALS, derive
from hapticvlm.rendering.felt_error import felt_differences, least_felt_error

LEAD = 0.15

NAMES = list(MATERIALS)
beliefs = st.dictionaries(st.sampled_from(NAMES), st.floats(1e-3, 1.0), min_size=1)


def difference(one: str, other: str) -> float:
    return float(felt_differences([MATERIALS[one], MATERIALS[other]])[0, 1])


def test_the_felt_difference_is_a_distance() -> None:
    d = felt_differences(list(MATERIALS.values()))
    assert np.array_equal(d, d.T)
    assert np.array_equal(np.diag(d), np.zeros(len(NAMES)))
    assert (d + np.eye(len(NAMES)) > 0.0).all()
    by_way_of = (d[:, :, None] + d[None, :, :]).min(axis=1)
    assert (d <= by_way_of + 0.1).all()  # the table is rounded to 0.1 dB


@given(beliefs)
def test_a_material_with_more_than_half_of_all_belief_is_the_one_that_is_felt(shares) -> None:
    best = max(shares, key=lambda name: shares[name])
    if shares[best] > 0.52 * sum(shares.values()):  # 0.02 for the rounding of the table
        assert least_felt_error(shares, MATERIALS) == best


@given(beliefs)
def test_only_what_is_believed_in_is_felt(shares) -> None:
    felt = least_felt_error(shares, MATERIALS)
    assert shares[felt] >= min(0.05, max(shares.values()))


def test_wood_or_leather_is_felt_rather_than_a_metal_that_is_a_little_more_probable() -> None:
    shares = {"metal": 0.36, "wood": 0.34, "leather": 0.3}
    assert least_felt_error(shares, MATERIALS) in ("wood", "leather")


@pytest.mark.parametrize(("lead", "felt"), [(LEAD - 0.02, "metal"), (LEAD + 0.02, "stone")])
def test_what_is_felt_already_is_kept_until_another_leads_by_enough(lead, felt) -> None:
    shares = {"stone": 0.4 + lead / 2.0, "metal": 0.4 - lead / 2.0}
    assert least_felt_error(shares, MATERIALS) == "stone"
    assert least_felt_error(shares, MATERIALS, "metal") == felt
    assert least_felt_error({"stone": 0.5, "metal": 0.01}, MATERIALS, "metal") == "stone"
    assert least_felt_error(shares, MATERIALS, "glass") == "stone"


def test_a_users_material_vibrates_like_its_class_and_has_its_own_heat() -> None:
    walnut = derive("walnut", "wood")
    copper = derive("copper", "wood", facts={"thermal": {"conductivity": 400, "density": 8900}})
    d = felt_differences([MATERIALS["wood"], walnut, copper, MATERIALS["fabric"]])
    assert d[0, 1] == 0.0
    assert d[0, 2] > 2.0
    assert d[3, 1] == pytest.approx(difference("wood", "fabric"))
