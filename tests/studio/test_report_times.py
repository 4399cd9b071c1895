"""Reaction times in a report: no quartiles of one answer, and no axis for one answer of all."""

import numpy as np
import pytest

from hapticvlm_studio.report import plots, text


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([], "-"),
        ([0.48], "0.48 of 1"),
        ([0.4, 0.5, 0.6], "0.50 of 3"),
        ([0.4, 0.5, 0.6, 0.7, 0.8], "0.60 (0.50-0.70)"),
    ],
)
def test_quartiles_are_told_of_five_answers_and_more(times, told):
    quartiles = np.percentile(times, [25, 50, 75]).tolist() if times else [None] * 3
    assert text._reaction(times, quartiles) == told


def test_an_answer_after_a_break_stands_beyond_the_axis():
    usual = [np.full(20, 0.8), np.full(19, 1.2)]
    assert plots._longest_shown(usual) is None  # the axis ends where the answers do
    assert plots._longest_shown([*usual, np.array([59.0])]) == pytest.approx(2.4)
    assert plots._longest_shown([np.array([])]) is None
