"""Tests waveforms: within the band, from and to zero, continuous, and different by material."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from each_case import each
from numpy.typing import NDArray
from waves import Wave, rms

from hapticvlm.materials import MATERIALS, Vibration
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.impacts import hardness, impact
from hapticvlm.rendering.vibration.perceived_level import sensation_db
from hapticvlm.rendering.vibration.textures import Texture, catching, rendered_hz
from hapticvlm.rendering.vibration.vibration import IMPACTS, RATE_HZ, TEXTURES, Motion

SLIP_M = 4e-3

FOUR = ("wood", "glass", "fabric", "metal")
SEEDS = range(8)  # of blows, as no two are equal
WOOD = MATERIALS["wood"].vibration


def rub(vibration: Vibration, interaction: str, motion: Motion, seconds: float = 1.0) -> Wave:
    """A steady texture, (N,), after its glide-in."""
    texture = Texture(vibration, interaction, seed=1)
    texture.render(RATE_HZ // 5, motion)
    return texture.render(int(seconds * RATE_HZ), motion)


def power(wave: Wave) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies in Hz and power; a wave that does not end by itself gets a Hann window."""
    size = max(wave.size, RATE_HZ)
    window = np.ones(wave.size) if wave[0] == 0.0 else np.hanning(wave.size)
    spectrum = np.abs(np.fft.rfft(wave * window, size)) ** 2
    return np.arange(float(spectrum.size)) * (RATE_HZ / size), np.asarray(spectrum)


def share_db(wave: Wave, low_hz: float, high_hz: float = RATE_HZ) -> float:
    frequency_hz, spectrum = power(wave)
    inside = (frequency_hz >= low_hz) & (frequency_hz < high_hz)
    return float(10 * np.log10(spectrum[inside].sum() / spectrum.sum() + 1e-30))


def band_db(wave: Wave, low_hz: float, high_hz: float) -> float:
    frequency_hz, spectrum = power(wave)
    inside = (frequency_hz >= low_hz) & (frequency_hz < high_hz)
    return float(10.0 * np.log10(spectrum[inside].sum()))


def centroid_hz(wave: Wave) -> float:
    frequency_hz, spectrum = power(wave)
    return float((frequency_hz * spectrum).sum() / spectrum.sum())


def felt_db(wave: Wave) -> float:
    """Energy over the threshold of a palm on a speaker, in dB, by thirds of an octave."""
    spectrum = np.abs(np.fft.rfft(wave, RATE_HZ)) ** 2
    edges = 10.0 * 2.0 ** (np.arange(20) / 3.0)
    total = 0.0
    for low_hz, high_hz in itertools.pairwise(edges):
        needed_db = drive_threshold_db(np.array([np.sqrt(low_hz * high_hz)]))[0]
        total += spectrum[int(low_hz) : int(high_hz)].sum() * 10.0 ** (-needed_db / 10.0)
    return float(10.0 * np.log10(total))


@each(interaction=TEXTURES, name=MATERIALS)
def test_a_texture_keeps_inside_the_band(name: str, interaction: str) -> None:
    for speed_mps in (0.02, 0.2, 2.0, 50.0):
        wave = rub(MATERIALS[name].vibration, interaction, Motion(speed_mps, 2.0))
        assert share_db(wave, 1050.0) < -50.0
        assert share_db(wave, 0.0, 1.0) < -40.0
        assert np.abs(wave).max() <= 1.5


@each(interaction=IMPACTS, name=MATERIALS)
def test_a_faster_impact_is_stronger_and_brighter(name: str, interaction: str) -> None:
    slow, middle, fast = (
        impact(MATERIALS[name].vibration, interaction, Motion(speed_mps, 1.0), 3)
        for speed_mps in (0.1, 0.5, 2.0)
    )

    assert rms(slow) < rms(middle) < rms(fast)
    if len(MATERIALS[name].vibration.modes) > 1:
        assert centroid_hz(slow) < centroid_hz(middle) < centroid_hz(fast)


def test_a_harder_press_is_stronger_and_needs_no_speed() -> None:
    soft, hard = (impact(WOOD, "press", Motion(0.0, force_n), 3) for force_n in (0.5, 5.0))

    assert 0.0 < rms(soft) < rms(hard)


@each(speed_mps=[0.05, 0.1, 0.5, 2.0], interaction=IMPACTS)
def test_a_blow_on_a_controller_is_as_strong_as_its_material_is_hard_at_any_speed(
    interaction: str, speed_mps: float
) -> None:
    motion = Motion(speed_mps, 1.0)
    controller = Playback(full_scale_db=None)
    beyond = [
        np.mean([felt_db(impact(m.vibration, interaction, motion, s, controller)) for s in SEEDS])
        - 20.0 * np.log10(hardness(m.vibration))
        for m in MATERIALS.values()
    ]

    assert np.ptp(beyond) < 1.6  # dB, the least difference of amplitude that is told apart
    hard, wood, soft = (hardness(MATERIALS[n].vibration) for n in ("glass", "wood", "rubber"))
    assert hard == 1.0
    assert soft < 0.5 * wood < 0.5 * hard
    assert 20.0 * np.log10(hard / soft) < 20.0


@each(interaction=IMPACTS, name=MATERIALS)
def test_every_blow_of_a_tenth_of_a_metre_a_second_is_felt_by_a_palm(
    name: str, interaction: str
) -> None:
    for speed_mps in (0.1, 0.3, 1.0):
        for seed in SEEDS:
            wave = impact(MATERIALS[name].vibration, interaction, Motion(speed_mps, 1.0), seed)
            assert sensation_db(wave.astype(float)) >= 6.0, (speed_mps, seed)


def test_a_weaker_speaker_or_a_duller_hand_gets_stronger_soft_blows_and_the_same_hard_ones() -> (
    None
):
    soft, weak = Motion(0.1, 1.0), Playback(full_scale_db=40.0)
    rubber, glass = (MATERIALS[name].vibration for name in ("rubber", "glass"))

    plain, lifted = (impact(rubber, "tap", soft, 1, each) for each in (NOMINAL, weak))
    assert felt_db(lifted) - felt_db(plain) > 3.0
    assert sensation_db(lifted.astype(float), 40.0) >= 6.0
    plain, lifted = (impact(glass, "strike", soft, 1, each) for each in (NOMINAL, weak))
    assert felt_db(lifted) - felt_db(plain) < 1.0


def test_a_palm_feels_a_blow_of_a_quarter_of_the_speed_half_as_strongly() -> None:
    slow, fast = (impact(WOOD, "strike", Motion(speed_mps, 1.0), 3) for speed_mps in (0.02, 0.08))

    assert felt_db(fast) - felt_db(slow) == pytest.approx(6.0, abs=0.7)


def test_a_hand_never_strikes_the_same_place_twice() -> None:
    waves = [impact(WOOD, "strike", Motion(0.5, 1.0), seed) for seed in range(40)]
    overtone_db = [band_db(wave, 170.0, 230.0) - band_db(wave, 80.0, 120.0) for wave in waves]

    assert 1.2 < np.std(overtone_db) < 5.0  # of +-6 dB, equally often


@each(name=MATERIALS)
def test_equal_blows_differ_by_about_half_of_what_is_just_noticed(name: str) -> None:
    facts = MATERIALS[name].vibration
    levels_db = [felt_db(impact(facts, "strike", Motion(0.5, 2.0), seed)) for seed in range(40)]

    assert np.mean(np.abs(np.diff(levels_db))) > 0.7
    assert np.std(levels_db) < (3.0 if name == "metal" else 1.6)  # metal beats


@pytest.mark.parametrize("name", ["glass", "ceramic", "plastic", "paper", "leather"])
def test_a_harder_slide_on_a_fine_surface_is_lower(name: str) -> None:
    light, hard = (
        centroid_hz(rub(MATERIALS[name].vibration, "slide", Motion(0.2, force_n), 4.0))
        for force_n in (0.3, 3.0)
    )

    assert hard < 0.95 * light


@pytest.mark.parametrize("speed_mps", [0.05, 0.1, 0.5, 2.0])
def test_a_surface_is_rubbed_as_strongly_as_it_is_rough_at_any_speed(speed_mps: float) -> None:
    motion = Motion(speed_mps, 0.0)  # without force nothing sticks
    beyond = [
        felt_db(rub(m.vibration, "slide", motion, 3.0)) - 20.0 * np.log10(m.vibration.roughness)
        for m in MATERIALS.values()
    ]

    assert np.ptp(beyond) < 3.0  # dB, about one step of amplitude discrimination


@each(force_n=[0.5, 1.0, 2.0, 4.0], speed_mps=[0.05, 0.1, 0.3, 0.5])
def test_window_glass_is_rubbed_12_db_below_granite_and_all_within_20(
    speed_mps: float, force_n: float
) -> None:
    motion = Motion(speed_mps, force_n)
    felt = {
        name: felt_db(rub(material.vibration, "slide", motion, 2.0))
        for name, material in MATERIALS.items()
    }

    assert felt["stone"] - felt["glass"] >= 12.0
    assert max(felt.values()) - min(felt.values()) < 22.0


def test_a_perfectly_smooth_surface_that_does_not_stick_is_not_felt() -> None:
    smooth = replace(MATERIALS["glass"].vibration, roughness=0.0, stick=0.0)

    assert not rub(smooth, "slide", Motion(0.1, 1.0)).any()


def test_stick_slip_needs_force_and_ends_when_the_hand_is_too_fast_to_catch() -> None:
    speeds = (0.05, 0.2, 0.5, 2.0)
    caught = [catching(0.7, Motion(speed_mps, 2.0)) for speed_mps in speeds]

    assert caught == sorted(caught, reverse=True)
    assert caught[0] > 0.3 > 3.0 * caught[-1]
    assert catching(0.7, Motion(0.1, 0.0)) == 0.0
    assert catching(0.7, Motion(0.5, 20.0)) > 1.5 * catching(0.7, Motion(0.5, 2.0))


def test_a_whoosh_is_as_high_as_what_is_swung_is_thin_and_no_two_materials_whoosh_alike() -> None:
    def whoosh(name: str, thickness_m: float | None = None) -> Wave:
        texture = Texture(MATERIALS[name].vibration, "swing", 1, thickness_m=thickness_m)
        texture.render(RATE_HZ // 5, Motion(4.0, 0.0))
        return texture.render(2 * RATE_HZ, Motion(4.0, 0.0))

    assert centroid_hz(whoosh("wood", 0.008)) == pytest.approx(0.2 * 4.0 / 0.008, rel=0.1)
    assert centroid_hz(whoosh("wood", 0.016)) == pytest.approx(0.2 * 4.0 / 0.016, rel=0.1)
    waves = [whoosh(name) for name in MATERIALS]
    for one, other in itertools.combinations(waves, 2):
        assert np.abs(one - other).max() > 0.05
    ratio = centroid_hz(whoosh("metal")) / centroid_hz(whoosh("wood"))
    assert ratio == pytest.approx(4.0, rel=0.1)


def test_glass_rings_as_real_glass_moved_into_the_band() -> None:
    preset_hz = np.array([1206.0, 2240.0, 3919.0, 5965.0])  # published, docs/physics.md 4.3
    modes_hz = np.array([mode.frequency_hz for mode in MATERIALS["glass"].vibration.modes])

    moved_hz = preset_hz * modes_hz[0] / preset_hz[0]
    assert modes_hz == pytest.approx(moved_hz[moved_hz <= 1000.0], rel=0.002)


def test_a_frequency_below_the_best_is_left_alone_and_above_it_keeps_its_order() -> None:
    assert [rendered_hz(hz) for hz in (0.0, 20.0, 250.0)] == [0.0, 20.0, 250.0]
    moved = [rendered_hz(hz) for hz in (250.0, 300.0, 400.0, 800.0, 1600.0)]
    assert moved == sorted(moved)
    assert len(set(moved)) == len(moved)
    assert rendered_hz(1e9) <= 360.0


def test_the_loudest_impact_uses_the_range_it_has() -> None:
    peaks = [
        np.abs(impact(m.vibration, "strike", Motion(30.0, 1.0), 0)).max()
        for m in MATERIALS.values()
    ]

    assert 0.75 < max(peaks) < 1.0


def test_materials_differ_in_pitch_or_in_ring() -> None:
    # Of several blows, as their places vary.
    waves = {
        n: [impact(MATERIALS[n].vibration, "strike", Motion(1.0, 1.0), seed) for seed in SEEDS]
        for n in FOUR
    }

    def ring_s(wave: Wave) -> float:
        energy = np.cumsum(np.square(wave, dtype=np.float64))
        return float(np.searchsorted(energy, 0.9 * energy[-1])) / RATE_HZ

    centroids = {name: [centroid_hz(wave) for wave in of] for name, of in waves.items()}
    rings = {name: [ring_s(wave) for wave in of] for name, of in waves.items()}
    for one, other in itertools.combinations(FOUR, 2):
        pitch = abs(np.mean(np.log2(centroids[one])) - np.mean(np.log2(centroids[other])))
        ring = abs(np.mean(np.log2(rings[one])) - np.mean(np.log2(rings[other])))
        assert pitch > np.log2(1.3) or ring > 1.0, (one, other)


def test_each_material_rubs_at_its_own_pitch() -> None:
    for name in FOUR:
        vibration = MATERIALS[name].vibration
        wave = rub(vibration, "slide", Motion(0.2, 0.0), 4.0)
        assert centroid_hz(wave) == pytest.approx(rendered_hz(0.2 / vibration.pitch_m), rel=0.1)


def test_the_pitch_of_rubbing_stops_at_its_limits() -> None:
    glass = MATERIALS["glass"].vibration

    assert centroid_hz(rub(glass, "slide", Motion(5.0, 0.0))) == pytest.approx(360.0, rel=0.05)
    slow = rub(glass, "slide", Motion(0.001, 0.0), 4.0)
    assert centroid_hz(slow) == pytest.approx(20.0, rel=0.1)


def test_what_sticks_slips_at_a_rate_that_rises_with_speed_under_a_firm_hand() -> None:
    sticky = replace(MATERIALS["rubber"].vibration, stick=0.95)

    def slips_hz(speed_mps: float, force_n: float) -> float:
        frequency_hz, spectrum = power(rub(sticky, "slide", Motion(speed_mps, force_n), 4.0))
        return float(frequency_hz[np.argmax(np.convolve(spectrum, np.ones(40), "same"))])

    assert slips_hz(0.15, 100.0) == pytest.approx(0.15 / SLIP_M, rel=0.15)
    assert slips_hz(0.30, 100.0) == pytest.approx(0.30 / SLIP_M, rel=0.15)
    assert slips_hz(0.15, 0.0) == pytest.approx(0.15 / sticky.pitch_m, rel=0.3)


def test_a_rougher_surface_is_patchier() -> None:
    def unevenness(roughness: float) -> float:
        wave = rub(replace(WOOD, roughness=roughness), "slide", Motion(0.3, 1.0), 4.0)
        pieces = np.array_split(np.square(wave, dtype=np.float64), 100)
        means = [piece.mean() for piece in pieces]
        return float(np.std(means) / np.mean(means))

    assert unevenness(1.0) > 1.3 * unevenness(0.1)


@pytest.mark.parametrize("interaction", IMPACTS)
def test_a_harder_hit_is_stronger_and_brighter(interaction: str) -> None:
    soft, hard = (impact(WOOD, interaction, Motion(0.3, force_n), 3) for force_n in (0.2, 20.0))

    assert rms(hard) > 1.2 * rms(soft)
    assert centroid_hz(hard) > centroid_hz(soft)


@each(name=FOUR, interaction=TEXTURES)
def test_a_faster_stroke_is_stronger(name: str, interaction: str) -> None:
    levels = [
        rms(rub(MATERIALS[name].vibration, interaction, Motion(speed_mps, 1.0), 4.0))
        for speed_mps in (0.02, 0.1, 0.5, 3.0)
    ]

    assert levels == sorted(levels)
    assert levels[0] < 0.8 * levels[-1]


@pytest.mark.parametrize("interaction", ["slide", "carve"])
def test_a_harder_stroke_is_stronger(interaction: str) -> None:
    light, hard = (rms(rub(WOOD, interaction, Motion(0.2, f), 2.0)) for f in (0.2, 4.0))

    assert hard > 1.3 * light


@pytest.mark.parametrize("interaction", TEXTURES)
def test_a_still_hand_feels_no_texture(interaction: str) -> None:
    still = Texture(WOOD, interaction, seed=1)
    assert not still.render(4800, Motion(0.0, 3.0)).any()

    stopping = Texture(WOOD, interaction, seed=1)
    stopping.render(4800, Motion(1.0, 3.0))
    stopping.render(9600, Motion(0.0, 3.0))
    assert not stopping.render(4800, Motion(0.0, 3.0)).any()


@pytest.mark.parametrize("interaction", TEXTURES)
def test_blocks_of_any_size_join_into_the_same_wave(interaction: str) -> None:
    strokes = (Motion(0.1, 1.0), Motion(1.5, 3.0), Motion(0.0, 1.0), Motion(0.4, 0.2))
    whole, cut = Texture(WOOD, interaction, seed=5), Texture(WOOD, interaction, seed=5)
    sizes = itertools.cycle((1, 128, 37, 64, 512, 0, 255))

    for motion in strokes:
        expected = whole.render(9600, motion)
        blocks, left = [], 9600
        while left:
            size = min(next(sizes), left)
            blocks.append(cut.render(size, motion))
            left -= size
        assert np.allclose(np.concatenate(blocks), expected, atol=2e-6)


def test_carving_breaks_fibres_ten_to_sixty_times_a_second() -> None:
    for speed_mps, rate_hz in ((0.001, 10.0), (0.1, 25.0), (10.0, 60.0)):
        texture = Texture(WOOD, "carve", seed=2)
        for _ in range(4000):
            texture.render(128, Motion(speed_mps, 1.0))
        assert texture._breaks is not None
        assert texture._breaks.begun / (4000 * 128 / RATE_HZ) == pytest.approx(rate_hz, rel=0.1)


def test_a_seed_decides_everything() -> None:
    motion = Motion(0.7, 1.0)

    assert np.array_equal(impact(WOOD, "tap", motion, 4), impact(WOOD, "tap", motion, 4))
    assert not np.array_equal(impact(WOOD, "tap", motion, 4), impact(WOOD, "tap", motion, 5))
    for interaction in TEXTURES:
        one, same, other = (Texture(WOOD, interaction, seed) for seed in (4, 4, 5))
        first = one.render(2000, motion)
        assert np.array_equal(first, same.render(2000, motion))
        assert not np.array_equal(first, other.render(2000, motion))


def test_another_sample_rate_keeps_the_pitch() -> None:
    waves = [
        impact(WOOD, "strike", Motion(1.0, 1.0), 0, Playback(rate_hz))
        for rate_hz in (48_000, 44_100)
    ]
    peaks_hz = [
        np.argmax(np.abs(np.fft.rfft(wave, rate_hz)))
        for wave, rate_hz in zip(waves, (48_000, 44_100), strict=True)
    ]

    assert abs(int(peaks_hz[0]) - int(peaks_hz[1])) <= 1
