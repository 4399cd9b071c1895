"""Tests the mixer: both hands, leases, fades, bounds, and what it drops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from each_case import each
from msgspec.structs import replace
from waves import BLOCK, Wave, above_band_db, listen, rms

from hapticvlm.materials import MATERIALS, Vibration
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import DELAY_S, Command, Voices

DELAY = round(DELAY_S * RATE_HZ)
BLOCK_S = BLOCK / RATE_HZ
SILENT_S = 0.020

SLIDE = Command(
    hand=0,
    material="wood",
    interaction="slide",
    onset=False,
    motion=Motion(0.3, 2.0),
    seed=1,
    expires_at=100.0,
)
STRIKE = replace(SLIDE, interaction="strike", onset=True, motion=Motion(1.0, 1.0))


def test_nothing_commanded_is_silence() -> None:
    voices = Voices()

    assert not listen(voices, 0.1).any()
    assert voices.level == 0.0
    assert voices.render(0, 0.0).shape == (0,)


def test_an_impact_begins_with_the_next_block_less_the_limiter_s_delay() -> None:
    voices = Voices()
    voices.apply(STRIKE)
    block = voices.render(BLOCK, 0.0)

    expected = impact(MATERIALS["wood"].vibration, "strike", STRIKE.motion, STRIKE.seed)
    assert DELAY_S < 0.002
    assert not block[:DELAY].any()
    assert np.allclose(block[DELAY:], expected[: BLOCK - DELAY], atol=1e-6)
    assert voices.level == pytest.approx(rms(block), rel=1e-4)


def test_an_impact_rings_once_and_leaves_no_texture() -> None:
    voices = Voices()
    voices.apply(STRIKE)

    assert rms(listen(voices, 0.2)) > 0.01
    assert not listen(voices, 0.2, now=0.2).any()


def test_an_impact_that_is_held_does_not_rub() -> None:
    struck, held = Voices(), Voices()
    for voices in (struck, held):
        voices.apply(replace(SLIDE, interaction="strike", onset=True))
    first = listen(struck, 0.05), listen(held, 0.05)
    held.apply(replace(SLIDE, interaction="strike"))

    assert np.array_equal(*first)
    assert np.array_equal(listen(struck, 0.2, now=0.05), listen(held, 0.2, now=0.05))


def test_a_stroke_update_keeps_the_same_texture_going() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    slow = listen(voices, 0.5)
    voices.apply(replace(SLIDE, seed=99, motion=Motion(1.0, 4.0)))
    fast = listen(voices, 0.5, now=0.5)

    assert rms(fast) > 1.2 * rms(slow)
    assert above_band_db(np.concatenate((slow, fast))) < -50.0


@each(command=[SLIDE, replace(STRIKE, material="metal")], block=[64, 128, 256, 512, 1024, 4096])
def test_a_lapsed_lease_is_silent_within_20_ms(command: Command, block: int) -> None:
    voices = Voices()
    voices.apply(replace(command, expires_at=0.1))
    wave = listen(voices, 0.4, block=block)

    assert rms(wave[: round(0.1 * RATE_HZ)]) > 0.005
    assert np.abs(wave[round(0.08 * RATE_HZ) : round(0.1 * RATE_HZ)]).max() > 0.0
    assert not wave[round((0.1 + SILENT_S) * RATE_HZ) :].any()
    assert above_band_db(wave) < -50.0


def test_a_renewed_lease_sounds_on() -> None:
    voices = Voices()
    wave = np.zeros(0, np.float32)
    for tenth in range(10):
        voices.apply(replace(SLIDE, expires_at=tenth / 10 + 0.25))
        wave = listen(voices, 0.1, now=tenth / 10)

    assert rms(wave) > 0.03


def test_a_command_that_arrives_after_its_end_never_sounds() -> None:
    for expires_at in (0.9, -math.inf, math.nan):
        voices = Voices()
        voices.apply(replace(STRIKE, expires_at=expires_at))
        voices.apply(replace(SLIDE, hand=1, expires_at=expires_at))
        assert not listen(voices, 0.2, now=1.0).any()


def test_release_fades_one_hand_and_leaves_the_other() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    voices.apply(replace(SLIDE, hand=1, material="glass"))
    listen(voices, 0.3)
    voices.release(0)
    listen(voices, SILENT_S, now=0.3)
    left_out = listen(voices, 0.3, now=0.32)
    voices.release(1)
    listen(voices, SILENT_S, now=0.62)

    assert rms(left_out) > 0.01
    assert not listen(voices, 0.1, now=0.64).any()


def test_rest_fades_everything_without_a_click() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    voices.apply(replace(STRIKE, hand=1, material="glass"))
    before = listen(voices, 0.05)
    voices.rest()
    after = listen(voices, 0.2, now=0.05)

    assert rms(before) > 0.05
    assert not after[round(SILENT_S * RATE_HZ) :].any()
    assert above_band_db(np.concatenate((before, after))) < -45.0


def test_a_hand_can_touch_again_after_its_release() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    listen(voices, 0.1)
    voices.release(0)
    listen(voices, 0.005, now=0.1)
    voices.apply(SLIDE)
    listen(voices, 0.05, now=0.105)

    assert rms(listen(voices, 0.3, now=0.155)) > 0.03


def test_both_hands_add_up() -> None:
    left, right, both = Voices(), Voices(), Voices()
    other = replace(SLIDE, hand=1, material="glass", interaction="carve", seed=7)
    left.apply(SLIDE)
    right.apply(other)
    both.apply(SLIDE)
    both.apply(other)
    alone = listen(left, 0.5) + listen(right, 0.5)

    quiet = np.abs(alone) < 0.8
    assert quiet.mean() > 0.95
    assert np.allclose(listen(both, 0.5)[quiet], alone[quiet], atol=1e-5)


def test_another_material_cross_fades_without_click_or_hole() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    before = listen(voices, 0.3)
    voices.apply(replace(SLIDE, material="metal"))
    after = listen(voices, 0.3, now=0.3)
    wave = np.concatenate((before, after))

    assert above_band_db(wave) < -50.0
    assert rms(after[: round(0.02 * RATE_HZ)]) > 0.2 * rms(before)
    fresh = Voices()
    fresh.apply(replace(SLIDE, material="metal"))
    listen(fresh, 0.3)
    assert rms(after[-4800:]) == pytest.approx(rms(listen(fresh, 0.1, now=0.3)), rel=0.5)


@pytest.mark.parametrize("material", [None, "unobtainium"])
def test_an_unknown_material_is_nothing_to_feel(material: str | None) -> None:
    voices = Voices()
    voices.apply(SLIDE)
    listen(voices, 0.1)
    voices.apply(replace(STRIKE, material=material))
    listen(voices, SILENT_S, now=0.1)

    assert not listen(voices, 0.2, now=0.12).any()


def test_a_swing_needs_no_contact_and_makes_no_impact() -> None:
    swing = replace(SLIDE, interaction="swing", motion=Motion(3.0, 0.0))
    plain, onset = Voices(), Voices()
    plain.apply(swing)
    onset.apply(replace(swing, onset=True))

    assert np.array_equal(listen(plain, 0.2), listen(onset, 0.2))
    assert rms(listen(plain, 0.2, now=0.2)) > 0.02


def test_a_slide_that_begins_a_contact_taps_first() -> None:
    voices = Voices()
    voices.apply(replace(SLIDE, onset=True))
    tap = impact(MATERIALS["wood"].vibration, "tap", SLIDE.motion, SLIDE.seed)

    first = listen(voices, 2 * BLOCK_S)
    assert np.abs(first).max() > 0.5 * np.abs(tap[:BLOCK]).max()
    listen(voices, 0.3, now=2 * BLOCK_S)
    assert rms(listen(voices, 0.3, now=0.31)) > 0.03


def test_a_new_impact_ends_the_texture_of_the_old_contact() -> None:
    voices = Voices()
    voices.apply(SLIDE)
    listen(voices, 0.2)
    voices.apply(replace(STRIKE, material="fabric"))
    listen(voices, 0.15, now=0.2)

    assert not listen(voices, 0.2, now=0.35).any()


def test_a_drum_roll_stays_bounded_and_is_counted() -> None:
    voices = Voices()
    for seed in range(40):
        voices.apply(replace(STRIKE, material="metal", seed=seed))
    wave = voices.render(BLOCK, 0.0)

    assert voices.dropped == 32
    assert np.abs(wave).max() <= 1.0


def test_a_hand_that_flickers_between_materials_settles_on_the_last() -> None:
    voices = Voices()
    names = list(MATERIALS)
    for step, count in enumerate((512, 256, 128, 64, 32, 16, 8, 4, 2, 1) * 5):
        voices.apply(replace(SLIDE, material=names[step % len(names)], seed=step))
        voices.render(count, 0.0)
        assert len(voices._hands[0].voices) <= 3
    voices.apply(replace(SLIDE, material="glass"))
    listen(voices, 0.1)

    assert [voice.key for voice in voices._hands[0].voices] == [("glass", "slide")]


def test_the_limiter_keeps_a_crowd_inside_the_range() -> None:
    voices = Voices()
    for seed in range(4):
        for hand in (0, 1):
            voices.apply(
                replace(STRIKE, hand=hand, material="glass", seed=seed, motion=Motion(20.0, 9.0))
            )
    wave = listen(voices, 0.3)

    assert 0.9 < np.abs(wave).max() <= 1.0
    assert np.abs(np.diff(wave)).max() < 0.5


def test_two_hands_at_full_level_keep_inside_the_band_at_every_moment() -> None:
    """Clipping leaves -22 dB above the band; a limiter with look-ahead leaves less."""
    voices = Voices()
    voices.apply(replace(SLIDE, material="stone", motion=Motion(2.0, 9.0)))
    blows = replace(STRIKE, hand=1, material="glass", motion=Motion(20.0, 9.0))
    waves = [listen(voices, 0.1)]
    for number in range(6):
        voices.apply(replace(blows, seed=number))
        voices.apply(replace(blows, hand=0, onset=True, seed=50 + number))
        waves.append(listen(voices, 0.1, now=0.1 + 0.1 * number))
    voices.rest()
    wave = np.concatenate([*waves, listen(voices, 0.1, now=0.7)])

    assert np.abs(wave).max() > 0.9
    assert above_band_db(wave) < -50.0
    moments = np.lib.stride_tricks.sliding_window_view(wave, RATE_HZ // 20)[:: RATE_HZ // 40]
    loud = [moment for moment in moments if rms(moment) > 0.03]
    assert max(above_band_db(moment) for moment in loud) < -45.0


@pytest.mark.parametrize("bad", [Motion(math.nan, 1.0), Motion(1.0, math.inf)])
def test_a_stroke_that_is_no_number_is_refused_and_counted(bad: Motion) -> None:
    voices = Voices()
    voices.apply(replace(STRIKE, motion=bad))

    assert voices.scrubbed == 1
    assert not listen(voices, 0.1).any()


def test_a_voice_that_turns_to_nan_is_dropped_and_the_rest_sounds_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(*_: object) -> Wave:
        return np.full(4800, np.nan, np.float32)

    voices, healthy = Voices(), Voices()
    voices.apply(replace(SLIDE, hand=1))
    healthy.apply(replace(SLIDE, hand=1))
    monkeypatch.setattr("hapticvlm.rendering.vibration.voices.impact", broken)
    voices.apply(STRIKE)
    wave = listen(voices, 0.2)

    assert voices.scrubbed == 1
    assert np.isfinite(wave).all()
    assert np.array_equal(wave, listen(healthy, 0.2))


def test_a_texture_that_turns_to_nan_is_dropped_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object, count: int, __: Motion) -> Wave:
        return np.full(count, np.nan, np.float32)

    voices = Voices()
    monkeypatch.setattr(Texture, "render", broken)
    voices.apply(SLIDE)

    assert not listen(voices, 0.2).any()
    assert voices.scrubbed == 1


def test_gain_scales_and_glides() -> None:
    full, half = Voices(), Voices(gain=0.5)
    full.apply(SLIDE)
    half.apply(SLIDE)
    loud, soft = listen(full, 0.3), listen(half, 0.3)
    assert np.allclose(soft, 0.5 * loud, atol=1e-6)

    full.gain = 0.0
    fading = listen(full, 0.1, now=0.3)
    assert not fading[round(SILENT_S * RATE_HZ) :].any()
    assert above_band_db(np.concatenate((loud, fading))) < -50.0


@pytest.mark.parametrize("interaction", ["slide", "carve", "swing"])
def test_huge_movements_stay_finite(interaction: str) -> None:
    voices = Voices()
    voices.apply(replace(SLIDE, interaction=interaction, motion=Motion(1e300, 1e300)))
    voices.apply(replace(STRIKE, hand=1, motion=Motion(1e300, 1e300)))
    wave = listen(voices, 0.1)

    assert np.isfinite(wave).all()
    assert np.abs(wave).max() <= 1.0
    assert voices.scrubbed == 0


@pytest.mark.slow
def test_every_material_and_interaction_can_be_felt() -> None:
    for name in MATERIALS:
        assert isinstance(MATERIALS[name].vibration, Vibration)
        for interaction in ("tap", "strike", "press", "slide", "carve", "swing"):
            voices = Voices()
            voices.apply(
                replace(STRIKE, material=name, interaction=interaction, motion=Motion(2.0, 2.0))
            )
            assert rms(listen(voices, 0.1)) > 0.005, (name, interaction)


@pytest.mark.parametrize("command", [STRIKE, SLIDE])
def test_a_command_of_half_the_gain_is_half_as_strong_and_none_is_stronger(command) -> None:
    waves = {}
    for gain in (1.0, 0.5, 3.0):
        voices = Voices()
        voices.apply(replace(command, gain=gain))
        waves[gain] = listen(voices, 0.2)
    faded = round(2 * SILENT_S * RATE_HZ)  # both have reached their gain by then
    assert np.allclose(waves[0.5][faded:], 0.5 * waves[1.0][faded:], atol=1e-6)
    assert np.abs(waves[3.0] - waves[1.0]).max() < 1e-6
