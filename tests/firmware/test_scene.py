"""A long busy scene: fast enough for tests, and repeatable bit for bit."""

from __future__ import annotations

import time

import pytest

from .build import Chip
from .busy import live

LONG_S, CPU_S = 600.0, 60.0


def test_a_scene_repeats_bit_for_bit_and_only_with_the_same_noise(chip: Chip) -> None:
    first, second, other = live(chip, 11.0), live(chip, 11.0), live(chip, 6.0, seed=2)

    assert first.fingerprints == second.fingerprints
    assert len(set(first.fingerprints)) == len(first.fingerprints)
    assert first.fingerprints[0] != other.fingerprints[0]


@pytest.mark.nightly
@pytest.mark.slow
def test_ten_busy_minutes_are_safe_and_take_less_than_one(chip: Chip) -> None:
    begun = time.process_time()
    scene = live(chip, LONG_S)
    cpu_s = time.process_time() - begun

    assert scene.touches > 100
    assert scene.resets == 1, "the one of opening the port"
    assert scene.faults == ()
    assert scene.skin_low_c > 13.0
    assert scene.skin_high_c < 43.0
    assert scene.dose_cem43 < 2.0
    assert scene.bytes_lost == 0
    print(f"{LONG_S:g} s in {cpu_s:.1f} s of processor time", scene)
    assert cpu_s < CPU_S
