"""Tests that a board clock with a wrong rate is detected, and that jitter and sleep are not."""

import random

import pytest

from hapticvlm.devices.plate.session import BoardClock


def is_wrong(
    rate: float, *, seconds: float = 60.0, jitter_s: float = 0.02, gap_s: float = 0.0
) -> bool:
    """Whether a clock at this rate counts as wrong; the line is not read for `gap_s`."""
    clock, chance, shift_s = BoardClock(), random.Random(3), 0.0
    for step in range(round(seconds / 0.05)):
        now = 100.0 + 0.05 * step
        if step == 500:
            shift_s = gap_s
        uptime_ms = round((now * rate + shift_s) * 1000.0) % 2**32
        clock.note(uptime_ms, now + chance.uniform(0.0, jitter_s))
    return clock.is_wrong


@pytest.mark.parametrize("rate", [0.442, 0.9, 1.1, 2.26])
def test_a_clock_of_another_rate_is_wrong(rate: float) -> None:
    assert is_wrong(rate)


@pytest.mark.parametrize("rate", [0.99, 1.0, 1.01])
def test_a_resonators_tolerance_and_a_slow_line_are_not(rate: float) -> None:
    assert not is_wrong(rate)
    assert not is_wrong(rate, jitter_s=0.4)


def test_a_machine_that_slept_for_an_hour_is_no_fault_of_the_board() -> None:
    assert not is_wrong(1.0, gap_s=3600.0)
