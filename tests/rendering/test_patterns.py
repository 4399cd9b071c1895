"""Tests recordings in place of synthesis: rates, channels, levels and clear errors."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import soundfile
from each_case import each
from msgspec.structs import replace
from numpy.typing import NDArray
from waves import above_band_db, listen

from hapticvlm.commands.main import main
from hapticvlm.devices.speaker.engine import AudioSettings, Engine
from hapticvlm.devices.speaker.ring import Ring
from hapticvlm.devices.speaker.speaker_files import SpeakerResponse, read_patterns, write_response
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.equaliser import Correction
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.patterns import (
    PRESETS,
    PatternError,
    PatternTexture,
    pattern,
    replaced_key,
)
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.touches.sound import sound, spectrum

Wave = NDArray[np.float64]
RUB = Command(1, "fabric", "slide", False, Motion(0.3, 2.0), 1, 100.0)


def tone(seconds: float = 0.5, hertz: float = 120.0, rate_hz: int = RATE_HZ) -> Wave:
    time = np.arange(int(seconds * rate_hz)) / rate_hz
    return np.asarray(0.3 * np.sin(2 * math.pi * hertz * time))


def peak_hz(wave: NDArray[np.float32]) -> float:
    spectrum = np.abs(np.fft.rfft(wave * np.hanning(wave.size)))
    return float(np.argmax(spectrum)) * RATE_HZ / wave.size


@pytest.mark.parametrize("rate_hz", [8_000, 22_050, 44_100, 48_000, 96_000])
@pytest.mark.parametrize("channels", [1, 2])
def test_a_recording_of_any_rate_and_either_channels_keeps_its_pitch(
    tmp_path: Path, rate_hz: int, channels: int
) -> None:
    sound = np.repeat(tone(1.0, rate_hz=rate_hz)[:, None], channels, axis=1)
    soundfile.write(tmp_path / "fabric-rubbing.wav", sound, rate_hz)
    (read,) = read_patterns(tmp_path, MATERIALS)

    assert read.key == ("fabric", "slide")
    assert peak_hz(read.samples) == pytest.approx(120.0, abs=3.0)
    voices = Voices(patterns=(read,))
    voices.apply(RUB)
    listen(voices, 0.1)
    assert peak_hz(listen(voices, 1.0, now=0.1)) == pytest.approx(120.0, abs=3.0)


def test_names_are_those_of_the_paper_or_a_material_and_an_interaction() -> None:
    assert [replaced_key(preset.name, MATERIALS) for preset in PRESETS] == [
        ("wood", "carve"),
        ("wood", "strike"),
        ("glass", "tap"),
        ("fabric", "slide"),
        ("metal", "swing"),
    ]
    assert replaced_key("my-oak-press", (*MATERIALS, "my-oak")) == ("my-oak", "press")
    with pytest.raises(PatternError, match=r"is not the name of a pattern.*wood-carving"):
        replaced_key("wood_carve", MATERIALS)


def test_every_preset_can_be_felt() -> None:
    for preset in PRESETS:
        voices = Voices()
        onset = preset.interaction in ("tap", "strike")
        voices.apply(
            Command(1, preset.material, preset.interaction, onset, preset.motion, 1, 100.0)
        )
        wave = listen(voices, 0.3)
        assert np.sqrt(np.mean(wave**2)) > 0.01, preset.name


def test_fabric_rubbing_and_metal_whooshing_lie_in_different_bands() -> None:
    levels = {}
    for preset in PRESETS:
        if preset.interaction in ("slide", "swing"):
            material = MATERIALS[preset.material]
            wave = sound(material, preset.interaction, preset.motion, 4.8).wave
            levels[preset.name] = np.array(spectrum(wave)[0])
    rubbing, whooshing = levels["fabric-rubbing"], levels["metal-whooshing"]
    felt = np.maximum(rubbing, whooshing) > -50.0

    assert (rubbing - whooshing)[felt].max() > 10.0
    assert (whooshing - rubbing)[felt].max() > 10.0


def test_a_recorded_impact_is_as_strong_as_what_it_replaces() -> None:
    motion = Motion(1.0, 2.0)
    burst = tone(0.2, 100.0) * np.exp(-20.0 * np.arange(9600) / RATE_HZ)
    for gain in (0.01, 1.0):
        recording = pattern(("wood", "strike"), gain * burst, RATE_HZ).impact(motion)
        facts = MATERIALS["wood"].vibration
        plain = [impact(facts, "strike", motion, seed).astype(float) for seed in range(8)]
        ratio = np.sum(recording.astype(float) ** 2) / np.mean(np.sum(np.square(plain), axis=1))
        assert abs(10 * np.log10(ratio)) < 2.0


def test_force_and_speed_set_its_level_and_a_still_hand_feels_nothing() -> None:
    recording = pattern(("wood", "slide"), tone(1.0), RATE_HZ)
    soft, hard = (PatternTexture(recording) for _ in range(2))
    low = np.sqrt(np.mean(soft.render(9600, Motion(0.05, 0.5)) ** 2))
    high = np.sqrt(np.mean(hard.render(9600, Motion(0.5, 5.0)) ** 2))
    assert high > 1.5 * low
    hard.render(9600, Motion(0.0, 5.0))
    assert not hard.render(480, Motion(0.0, 5.0)).any()


@pytest.mark.parametrize("interaction", ["slide", "strike"])
def test_what_a_recording_has_outside_the_band_is_not_played(interaction: str) -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.2, RATE_HZ)
    recording = pattern(("wood", interaction), noise, RATE_HZ)
    voices = Voices(patterns=(recording,))
    strikes = interaction == "strike"
    command = replace(RUB, material="wood", interaction=interaction, onset=strikes)
    voices.apply(replace(command, expires_at=0.5))
    wave = listen(voices, 0.8)

    assert np.abs(wave).max() <= 1.0
    assert above_band_db(wave) < -50.0
    assert not wave[round(0.52 * RATE_HZ) :].any()


def test_a_looped_recording_has_no_seam() -> None:
    recording = pattern(("wood", "slide"), tone(0.3, 97.3), RATE_HZ)
    wave = PatternTexture(recording).render(2 * RATE_HZ, Motion(0.5, 2.0))

    assert above_band_db(wave) < -50.0


def test_blocks_of_any_size_join() -> None:
    recording = pattern(("wood", "slide"), tone(0.3), RATE_HZ)
    whole, cut = PatternTexture(recording), PatternTexture(recording)
    blocks = [cut.render(size, RUB.motion) for size in (1, 300, 0, 77, 9222)]
    assert np.allclose(np.concatenate(blocks), whole.render(9600, RUB.motion), atol=2e-6)


def test_a_speaker_weak_at_a_recordings_pitch_is_driven_harder() -> None:
    both = tone(1.0, 60.0) + tone(1.0, 250.0)
    flat = pattern(("wood", "slide"), both, RATE_HZ)
    recording = pattern(
        ("wood", "slide"), both, RATE_HZ, Correction((40.0, 80.0, 250.0), (6, 6, 0))
    )

    def tilt_db(wave: NDArray[np.float32]) -> float:
        spectrum = np.abs(np.fft.rfft(wave * np.hanning(wave.size), 10 * RATE_HZ))
        return float(20 * np.log10(spectrum[590:610].max() / spectrum[2490:2510].max()))

    assert tilt_db(recording.samples) - tilt_db(flat.samples) == pytest.approx(6.0, abs=0.3)


def write(path: Path, samples: Wave, rate_hz: int = RATE_HZ) -> None:
    soundfile.write(path, samples, rate_hz, subtype="FLOAT")


BAD = {
    "silent": (np.zeros(RATE_HZ), "nothing can be felt"),
    "beyond the band": (tone(1.0, 5000.0), "nothing can be felt"),
    "not numbers": (np.full(RATE_HZ, np.nan), "not numbers"),
    "infinite": (np.where(np.arange(RATE_HZ) == 9, np.inf, tone(1.0)), "not numbers"),
    "too long": (tone(11.0), "cut it"),
    "too short": (tone(0.01), "record longer"),
    "empty": (np.zeros(0), "record longer"),
    "huge": (1e6 * tone(), "1000 times full scale"),
    "one channel inverted": (np.stack((tone(), -tone()), axis=1), "cancel each other"),
    "six channels": (np.zeros((RATE_HZ, 6)), "channels"),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_recording_is_refused_by_name_with_its_fault(tmp_path: Path, kind: str) -> None:
    samples, said = BAD[kind]
    write(tmp_path / "glass-tap.wav", samples)
    with pytest.raises(PatternError, match=said) as refusal:
        read_patterns(tmp_path, MATERIALS)
    assert "glass-tap.wav" in str(refusal.value)


def test_other_faults_of_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="no such folder"):
        read_patterns(tmp_path / "nowhere", MATERIALS)
    with pytest.raises(PatternError, match="0 sound files"):
        read_patterns(tmp_path, MATERIALS)
    (tmp_path / "glass-tap.wav").write_bytes(b"RIFF nonsense")
    with pytest.raises(PatternError, match="not a readable sound file"):
        read_patterns(tmp_path, MATERIALS)
    write(tmp_path / "glass-tap.wav", tone())
    write(tmp_path / "glass-tapping.wav", tone())
    with pytest.raises(PatternError, match="replace the same pattern"):
        read_patterns(tmp_path, MATERIALS)
    (tmp_path / "glass-tapping.wav").rename(tmp_path / "glas-tap.wav")
    with pytest.raises(PatternError, match=r"glas-tap.*is not the name of a pattern"):
        read_patterns(tmp_path, MATERIALS)


def test_the_engine_plays_the_patterns_it_is_given(tmp_path: Path) -> None:
    write(tmp_path / "wood-strike.wav", tone(0.3, 333.0))
    settings = AudioSettings(patterns=read_patterns(tmp_path, MATERIALS))
    ring = Ring.create()
    engine = Engine(ring, settings)
    strike = replace(RUB, material="wood", interaction="strike", onset=True, expires_at=math.inf)
    ring.put(strike, 0.0)
    wave = np.concatenate([engine.fill(128) for _ in range(100)])
    assert peak_hz(wave) == pytest.approx(333.0, abs=8.0)


def felt(*options: str, capsys: pytest.CaptureFixture[str]) -> dict[float, float]:
    """Levels in dB by frequency in Hz of a strike on wood, as `feel` prints them."""
    arguments = ["feel", "wood", "strike", "--seconds", "0.5", "--json"]
    assert main([*arguments, *options]) == 0
    bands = json.loads(capsys.readouterr().out)["vibration"]["spectrum"]
    return dict(zip(bands["frequency_hz"], bands["level_db"], strict=True))


def test_feel_plays_the_recordings_and_corrects_the_speaker_as_serve_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "wood-strike.wav", tone(0.3, 333.0))
    write(tmp_path / "glass-tap.wav", tone(0.3, 150.0))
    curve = tmp_path / "curve.toml"
    write_response(curve, SpeakerResponse((20.0, 80.0, 250.0, 1000.0), (12.0, 12.0, 0.0, 0.0)))

    plain, recorded = felt(capsys=capsys), felt("--patterns", str(tmp_path), capsys=capsys)
    corrected = felt("--speaker-response", str(curve), capsys=capsys)
    assert max(plain, key=plain.__getitem__) < 200.0
    assert max(recorded, key=recorded.__getitem__) == pytest.approx(333.0, rel=0.13)
    tilts = [levels[78.75] - levels[250.0] for levels in (plain, corrected)]
    assert tilts[0] - tilts[1] == pytest.approx(12.0, abs=2.0)
    assert main(["feel", "wood", "--patterns", str(tmp_path / "nowhere")]) == 2
    assert "no such folder" in capsys.readouterr().err


def tap(seconds: float = 0.3) -> Wave:
    time = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    return np.asarray(0.4 * np.sin(2 * math.pi * 350 * time) * np.exp(-22 * time))


def level_db(wave: NDArray[np.float32]) -> float:
    return float(10 * np.log10(np.sum(np.square(wave, dtype=np.float64))))


def onset_s(wave: NDArray[np.float32]) -> float:
    return float(np.argmax(np.abs(wave) > 0.2 * np.abs(wave).max())) / RATE_HZ


@each(offset=[0.0, 0.1, -0.5, 0.8], lead_s=[0.0, 0.05, 0.3, 2.0])
def test_a_tap_with_any_lead_and_offset_is_felt_at_once_and_at_its_level(
    lead_s: float, offset: float
) -> None:
    noise = np.random.default_rng(1).normal(0.0, 1e-3, round(lead_s * RATE_HZ))
    recording = pattern(("glass", "tap"), np.r_[noise, tap()] + offset, RATE_HZ)
    plain = pattern(("glass", "tap"), tap(), RATE_HZ)

    assert onset_s(recording.samples) < 0.003
    assert recording.lead_s == pytest.approx(max(lead_s - 0.001, 0.0), abs=0.0021)
    assert level_db(recording.samples) == pytest.approx(level_db(plain.samples), abs=0.5)
    assert peak_hz(recording.samples) == pytest.approx(350.0, abs=8.0)


def test_an_offset_is_no_part_of_a_recorded_texture() -> None:
    plain, lifted = (pattern(("wood", "slide"), tone() + up, RATE_HZ) for up in (0.0, 0.6))
    assert level_db(lifted.samples) == pytest.approx(level_db(plain.samples), abs=0.1)


def test_several_taps_in_one_file_are_refused_with_their_times() -> None:
    with pytest.raises(PatternError, match=r"holds 3 events \(at 0.00, 0.30, 0.60 s\).*cut it"):
        pattern(("glass", "tap"), np.r_[tap(), tap(), tap()], RATE_HZ)


def test_a_strike_that_beats_is_one_event() -> None:
    time = np.arange(RATE_HZ) / RATE_HZ
    beats = np.sin(2 * math.pi * 300 * time) + np.sin(2 * math.pi * 315 * time)
    assert pattern(("glass", "strike"), 0.2 * beats * np.exp(-5 * time), RATE_HZ).lead_s < 0.002


def test_an_impact_that_lasts_too_long_from_its_onset_is_refused() -> None:
    with pytest.raises(PatternError, match=r"lasts 2\.\d+ s from its onset, at most 2"):
        pattern(("glass", "tap"), np.r_[np.zeros(RATE_HZ), tap(2.5)], RATE_HZ)


def test_files_are_read_as_systems_and_recorders_leave_them(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "GLASS-TAPPING.WAV", tap(), RATE_HZ)
    (tmp_path / "._GLASS-TAPPING.WAV").write_bytes(b"\0\5\x16\7Mac OS X")
    soundfile.write(tmp_path / "Wood-Strike.flac", tap(), RATE_HZ)
    keys = [recording.key for recording in read_patterns(tmp_path, MATERIALS)]
    assert sorted(keys) == [("glass", "tap"), ("wood", "strike")]


def test_a_recording_whose_header_was_never_finished_is_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "glass-tap.wav"
    soundfile.write(path, tap() + 0.1, RATE_HZ)
    (whole,) = read_patterns(tmp_path, MATERIALS)
    content = bytearray(path.read_bytes())
    content[4:8] = content[40:44] = bytes(4)
    path.write_bytes(content)
    (repaired,) = read_patterns(tmp_path, MATERIALS)
    assert np.array_equal(repaired.samples, whole.samples)

    soundfile.write(path, tap()[:0], RATE_HZ)
    path.write_bytes(path.read_bytes() + b"LIST" + (4000).to_bytes(4, "little") + bytes(4000))
    with pytest.raises(PatternError, match="record longer"):
        read_patterns(tmp_path, MATERIALS)
