"""The paper's study data agree with every figure the paper prints of them."""

from __future__ import annotations

import numpy as np
import pytest

from hapticvlm_studio.design import paper

# Table of the paper, diagonal, as printed.
PRINTED_DIAGONAL = (1.00, 0.93, 0.82, 0.80, 0.80, 0.93, 0.80, 0.78, 0.76, 0.84)


def test_every_row_is_one_pattern_felt_45_times():
    counts = paper.confusion()

    assert counts.shape == (10, 10)
    assert (counts.sum(axis=1) == paper.PARTICIPANTS * paper.REPEATS).all()
    assert paper.CODES[:2] == ("WC-h", "GT-h")
    assert paper.CODES[5:7] == ("WC-c", "GT-c")


def test_the_diagonal_rounds_to_the_printed_one():
    share = np.diag(paper.confusion()) / 45

    assert np.round(share, 2) == pytest.approx(PRINTED_DIAGONAL)
    right = np.trace(paper.confusion())
    assert right == 381
    assert round(100 * right / 450, 2) == 84.67


def test_errors_are_50_of_the_material_14_of_the_temperature_and_5_of_both():
    counts = paper.confusion().reshape(2, 5, 2, 5)
    same_temperature = np.einsum("ivik->ivk", counts)
    right = np.trace(paper.confusion())
    material_only = same_temperature.sum() - right
    temperature_only = np.einsum("iviv->", counts[:, :, ::-1, :])

    assert (material_only, temperature_only) == (50, 14)
    assert counts.sum() - right - material_only - temperature_only == 5
