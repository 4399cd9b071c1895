"""Tests presses: softer materials have denser grains, and only while the press deepens."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as changed
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.equaliser import Playback
from hapticvlm.rendering.vibration.grains import Grains, steps
from hapticvlm.rendering.vibration.patterns import Pattern
from hapticvlm.rendering.vibration.textures import grain
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.vibration_plan import PLAN_HZ
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.touches.sound import sound

Wave = NDArray[np.float32]
BLOCK = 128
SOFT = ("foliage", "fabric", "rubber", "leather", "paper")
PRESS = Command(1, "rubber", "press", True, Motion(0.1, 1.0), 3, 100.0)


def press(name: str, newtons: float, seconds: float, hold_s: float = 0.1, seed: int = 3) -> Wave:
    """Press harder and harder, then hold; return the grains alone, (N,)."""
    grains = Grains(MATERIALS[name].vibration, seed)
    blocks = round((seconds + hold_s) * RATE_HZ / BLOCK)
    rising = (min(newtons * at * BLOCK / RATE_HZ / seconds, newtons) for at in range(blocks))
    return np.concatenate([grains.render(BLOCK, Motion(0.0, force_n)) for force_n in rising])


def begun(wave: Wave) -> int:
    """Count the grains by where they begin: the loudest of 10 ms after less than a half of it.

    A grain of 60 Hz has a lobe each 8 ms.
    """
    frames = wave[: wave.size // 480 * 480].reshape(-1, 480)
    loud = np.abs(frames).max(axis=1)
    is_loud = loud > 0.5 * loud.max() if loud.max() > 0.0 else loud > 1.0
    return int(np.count_nonzero(np.diff(is_loud.astype(int), prepend=0) == 1))


def test_the_softer_it_is_the_denser_the_grains_and_stone_has_none() -> None:
    energies = [float(np.square(press(name, 3.0, 1.0)).sum()) for name in SOFT]
    assert energies[1:] == sorted(energies[1:], reverse=True)
    assert energies[0] > 2.0 * energies[1]
    for name in set(MATERIALS) - set(SOFT):
        assert not np.isfinite(MATERIALS[name].vibration.stiffness), name
        assert steps(MATERIALS[name].vibration, 20.0) == 0.0


@pytest.mark.parametrize(("name", "newtons"), [("rubber", 3.0), ("leather", 5.0), ("paper", 9.0)])
def test_a_grain_comes_for_each_step_that_it_gives_way(name: str, newtons: float) -> None:
    expected = newtons / (MATERIALS[name].vibration.stiffness * 2.5e-4)
    assert abs(begun(press(name, newtons, 2.0)) - expected) <= 1


def test_a_sudden_press_of_the_softest_is_no_tone() -> None:
    grains = Grains(MATERIALS["foliage"].vibration, 3)
    wave = np.concatenate([grains.render(BLOCK, Motion(0.0, 20.0)) for _ in range(40)])
    one = float(np.square(press("paper", 3.0, 1.0)).sum())
    assert np.square(wave).sum() < (120.0 * wave.size / RATE_HZ + 2) * 4.0 * one
    assert np.abs(wave).max() < 1.0


def test_a_hand_that_holds_or_lets_go_feels_none_and_presses_anew_to_feel_them_again() -> None:
    grains = Grains(MATERIALS["rubber"].vibration, 3)

    def reach(force_n: float) -> float:
        blocks = [grains.render(BLOCK, Motion(0.0, force_n)) for _ in range(100)]
        return float(np.abs(np.concatenate(blocks)).max())

    assert reach(4.0) > 0.1
    assert reach(4.0) == 0.0
    assert reach(1.0) == 0.0
    assert reach(4.0) > 0.1


def test_blocks_of_any_size_join() -> None:
    def rendered(size: int) -> Wave:
        grains = Grains(MATERIALS["fabric"].vibration, 3)
        motion = Motion(0.0, 2.0)
        return np.concatenate([grains.render(size, motion) for _ in range(4096 // size)])

    np.testing.assert_allclose(rendered(16), rendered(1024), atol=1e-6)


def test_a_fork_has_the_same_future_and_changes_nothing() -> None:
    grains = Grains(MATERIALS["rubber"].vibration, 3)
    grains.render(BLOCK, Motion(0.0, 1.0))
    forked = grains.fork()
    foreseen = [forked.render(BLOCK, Motion(0.0, 3.0)) for _ in range(20)]
    came = [grains.render(BLOCK, Motion(0.0, 3.0)) for _ in range(20)]
    np.testing.assert_array_equal(foreseen, came)


def felt(command: Command, forces_n: list[float], voices: Voices | None = None) -> Wave:
    """Press through the mixer with a new force every 20 ms; return the wave, (N,)."""
    voices = voices or Voices()
    voices.apply(command)
    blocks = []
    for number, force_n in enumerate(forces_n):
        now = number * 0.02
        motion = Motion(0.0, force_n)
        voices.apply(changed(command, onset=False, motion=motion))
        blocks += [voices.render(240, now + part * 0.005) for part in range(4)]
    return np.concatenate(blocks)


RISING = [0.2 * step for step in range(40)]


def test_rubber_and_stone_are_told_apart_by_the_press_alone() -> None:
    after = round(0.25 * RATE_HZ)  # the blow has rung out
    soft, hard = (
        felt(changed(PRESS, material=name), RISING)[after:] for name in ("rubber", "stone")
    )
    assert np.abs(soft).max() > 0.1
    assert np.abs(hard).max() < 0.01
    spectrum = np.abs(np.fft.rfft(soft * np.hanning(soft.size))) ** 2
    hertz = np.fft.rfftfreq(soft.size, 1.0 / RATE_HZ)
    assert 10 * np.log10(spectrum[hertz > 1050].sum() / spectrum.sum()) < -50.0


def test_a_press_ends_with_its_lease_and_when_the_hand_slides_on() -> None:
    for second in (changed(PRESS, expires_at=0.3), PRESS):
        voices = Voices()
        felt(second, RISING[:15], voices)
        if second is PRESS:
            voices.apply(changed(PRESS, interaction="slide", onset=False, motion=Motion(0.0, 9.0)))
        later = np.concatenate([voices.render(240, 0.35 + at * 0.005) for at in range(20)])
        assert np.abs(later[round(0.06 * RATE_HZ) :]).max() < 1e-3


def test_a_press_that_is_taken_up_without_its_blow_gives_way_too() -> None:
    voices = Voices()
    assert voices.is_silent
    voices.apply(changed(PRESS, onset=False, motion=Motion(0.0, 4.0)))
    assert np.abs(np.concatenate([voices.render(240, at * 0.005) for at in range(20)])).max() > 0.1
    stone = Voices()
    stone.apply(changed(PRESS, material="stone", onset=False, motion=Motion(0.0, 4.0)))
    assert stone.is_silent


def test_what_is_not_sure_gives_way_more_gently() -> None:
    after = round(0.25 * RATE_HZ)
    sure, unsure = (
        np.abs(felt(changed(PRESS, gain=gain), RISING)[after:]).max() for gain in (1.0, 0.5)
    )
    assert unsure == pytest.approx(0.5 * sure, rel=0.1)


def test_a_recorded_press_is_played_as_it_was_recorded() -> None:
    recorded = Pattern("rubber", "press", np.zeros(4800, np.float32), MATERIALS["rubber"].vibration)
    voices = Voices(patterns=(recorded,))
    assert not felt(PRESS, RISING, voices).any()


def test_a_stiffness_of_ones_own_is_felt() -> None:
    soft = replace(MATERIALS["wood"].vibration, stiffness=1000.0)
    assert steps(soft, 1.0) == pytest.approx(4.0)


def test_a_press_that_is_exported_gives_way_as_its_force_builds_up() -> None:
    soft, hard = (
        sound(MATERIALS[name], "press", Motion(0.1, 6.0), 1.0).wave for name in ("rubber", "stone")
    )
    building = slice(round(0.15 * RATE_HZ), round(0.35 * RATE_HZ))
    assert np.abs(soft[building]).max() > 0.1
    assert np.abs(hard[building]).max() < 0.01


def test_a_grain_is_as_strong_at_the_rate_of_controllers_as_at_that_of_the_speaker() -> None:
    for material in MATERIALS.values():
        played, planned = (grain(material.vibration, Playback(rate)) for rate in (RATE_HZ, PLAN_HZ))
        assert np.abs(planned).max() == pytest.approx(np.abs(played).max(), rel=0.1), material.name
