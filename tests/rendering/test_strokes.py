"""Tests that a stroke begins and ends at rest, and is fastest in its middle."""

from __future__ import annotations

import numpy as np
import pytest
from each_case import each

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import (
    IMPACTS,
    PAUSE_S,
    RATE_HZ,
    SWEEP_S,
    TEXTURES,
    Motion,
    motion_at,
)
from hapticvlm.touches.sound import sound

PEAK = Motion(2.0, 3.0)


@pytest.mark.parametrize("interaction", TEXTURES)
def test_a_sweep_is_a_bell_that_peaks_in_its_middle(interaction: str) -> None:
    sweep_s = SWEEP_S[interaction]
    speeds = [motion_at(interaction, PEAK, x * sweep_s).speed_mps for x in np.linspace(0, 0.99, 34)]

    assert speeds[0] == 0.0
    assert motion_at(interaction, PEAK, sweep_s / 2).speed_mps == pytest.approx(2.0)
    assert max(speeds) <= 2.0
    rising = np.diff(speeds) > 0.0
    assert rising[:16].all()
    assert not rising[17:].any()


@pytest.mark.parametrize("interaction", TEXTURES)
def test_sweeps_follow_each_other_with_rests_between_and_equal_force(interaction: str) -> None:
    sweep_s, again_s = SWEEP_S[interaction], SWEEP_S[interaction] + PAUSE_S[interaction]
    rests = np.linspace(sweep_s, again_s, 5)

    assert all(motion_at(interaction, PEAK, at).speed_mps < 1e-9 for at in rests)
    first, second = (motion_at(interaction, PEAK, n * again_s + 0.1) for n in (0, 1))
    assert first.speed_mps == pytest.approx(second.speed_mps)
    assert first.force_n == PEAK.force_n


@pytest.mark.parametrize("interaction", IMPACTS)
def test_a_blow_has_the_speed_it_arrives_with(interaction: str) -> None:
    assert motion_at(interaction, PEAK, 0.37) == PEAK


@pytest.mark.parametrize(("interaction", "speed_mps"), [("slide", 0.2), ("swing", 5.0)])
def test_rubbing_and_whooshing_swell_and_sweep(interaction: str, speed_mps: float) -> None:
    sweep_s = SWEEP_S[interaction]
    wave = sound(MATERIALS["fabric"], interaction, Motion(speed_mps, 1.0), 1.2).wave

    def near(at_s: float) -> np.ndarray:
        at = round(at_s * RATE_HZ)
        return wave[at : at + round(0.08 * RATE_HZ)].astype(np.float64)

    begin, middle = near(0.0), near(0.45 * sweep_s)
    assert np.sqrt(np.mean(middle**2)) > 1.5 * np.sqrt(np.mean(begin**2))
    crossings = [np.sum(np.diff(np.sign(part)) != 0) for part in (begin, middle)]
    assert crossings[1] > 1.3 * crossings[0]


@each(seconds=[0.02, 0.3, 1.3], interaction=[None, *IMPACTS, *TEXTURES])
def test_every_sound_begins_and_ends_at_zero(interaction: str | None, seconds: float) -> None:
    wave = sound(MATERIALS["glass"], interaction, Motion(1.0, 2.0), seconds).wave

    assert wave.size == round(seconds * RATE_HZ)
    assert wave[0] == wave[-1] == 0.0
    assert np.abs(np.diff(wave)).max() < 0.14
