"""`hapticvlm feel`: numbers are those of the models, sound is in its band, errors help."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import wave
from dataclasses import asdict
from xml.etree import ElementTree

import numpy as np
import pytest

import hapticvlm
from hapticvlm.commands.main import main
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.vibration_plan import amplitudes
from hapticvlm.touches.heat import ThermalInputs, heat
from hapticvlm.touches.sound import sound, spectrum

pytestmark = pytest.mark.process


def feel(capsys: pytest.CaptureFixture[str], *arguments: str):
    assert main(["feel", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_skin_is_what_the_contact_model_says():
    thermal = asdict(hapticvlm.feel("glass", object_c=10, skin_c=33, seconds=2).heat)

    contact = thermal_contact(MATERIALS["glass"].thermal, 10.0, skin_c=33.0)
    assert thermal["contact_resistance"] == contact.contact_resistance
    assert thermal["effusivity"] == pytest.approx(1449, abs=1)
    assert thermal["skin_effusivity"] == pytest.approx(1181, abs=1)
    assert thermal["time_s"][0] == 0.0
    assert thermal["time_s"][-1] == pytest.approx(2.0)
    for time_s, skin_c in zip(thermal["time_s"], thermal["skin_c"], strict=True):
        assert skin_c == pytest.approx(skin_surface_c(contact, time_s), abs=1e-9)


def test_the_setpoint_keeps_the_limits_and_says_which_shaped_it(capsys):
    thermal = feel(capsys, "metal", "--object-c", "-10")["thermal"]

    setpoints = thermal["setpoint_c"]
    assert len(setpoints) == len(thermal["time_s"]) == len(thermal["limited_by"])
    assert max(np.abs(np.diff(setpoints))) <= 12.0 * 0.02 + 1e-9
    assert setpoints[-1] == 18.0
    assert thermal["limited_by"][0] == "slew"
    assert thermal["limited_by"][-1] == "setpoint"
    assert thermal["unlimited_c"][-1] < 1.0


def test_a_pad_plays_one_tone_without_heat_whose_strength_is_that_of_a_plan():
    felt = hapticvlm.feel("wood", "slide", object_c=5, seconds=2.0)
    pad = felt.on("pad")
    power = np.abs(np.fft.rfft(pad.vibration)) ** 2
    hertz = np.fft.rfftfreq(pad.vibration.size, 1.0 / RATE_HZ)
    assert power[abs(hertz - 160.0) < 40.0].sum() > 0.98 * power.sum()
    assert set(pad.plate_c) == {32.0}
    strengths = pad.vibration.reshape(-1, RATE_HZ // 80)
    planned = amplitudes(felt.clip().played, "amplitude")
    assert np.abs(strengths).max(axis=1) == pytest.approx(planned, abs=0.01)
    intiface = felt.on("intiface")
    assert np.abs(intiface.vibration).max() == pytest.approx(planned.max(), abs=0.01)
    assert list(intiface.plate_c) == list(felt.plate_c)


def test_a_quest_controller_plays_the_wave_that_a_palm_speaker_plays():
    felt = hapticvlm.feel("glass", "slide", seconds=1.0)
    error = felt.on("quest").vibration - felt.vibration
    assert np.sqrt(np.mean(error**2)) < 0.05 * np.sqrt(np.mean(felt.vibration**2))


def test_a_glove_is_told_its_texture_click_force_and_heat(capsys):
    assert main(["feel", "metal", "--object-c", "5", "--force", "2.5", "--on", "weart"]) == 0
    contact, later = capsys.readouterr().out.splitlines()[-2:]
    assert contact.startswith("at contact: force:0.50:0.0:0.0, texture:0:0.5:0.0:0.50:60.0, temp")
    assert re.fullmatch(r"after it: force:0.50.*, texture:20:.*, temperature:0.00", later)
    document = feel(capsys, "metal", "--object-c", "5", "--force", "2.5", "--on", "weart")
    assert document["texts"] == [contact, later]
    assert "vibration" not in document  # which would be a wave of zeros


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["wood", "--on", "weart", "--save", "a.wav"], "leave out --save"),
        (["wood", "--on", "pad", "--save", "a.haptic"], "--on is for one touch"),
        (["all", "--on", "pad", "--save", "a.html"], "--on is for one touch"),
    ],
)
def test_a_file_that_an_output_cannot_have_is_refused(arguments, says, capsys):
    assert main(["feel", *arguments]) == 2
    assert says in capsys.readouterr().err


def test_the_plate_leads_because_the_hand_approached():
    found = heat(MATERIALS["wood"], ThermalInputs(None, 22.0), 1.0)

    assert found.setpoint_c[0] < found.skin_c[0] - 0.5
    assert found.limited_by[-1] is None
    assert found.setpoint_c[-1] == pytest.approx(found.skin_c[-1], abs=0.2)


def test_object_and_hand_have_usual_temperature_and_force_unless_stated(capsys):
    document = feel(capsys, "wood")
    assert document["thermal"]["surface_c"] == 22.0
    assert document["vibration"]["force_n"] == 1.0
    assert hapticvlm.feel("wood", ambient_c=15.0).heat.surface_c == 15.0
    assert hapticvlm.feel("wood", ambient_c=15.0, object_c=30.0).heat.surface_c == 30.0


def test_an_object_at_skin_temperature_is_said_to_carry_no_cue(capsys):
    assert main(["feel", "metal", "--object-c", "32.1", "--seconds", "1"]) == 0
    assert "no thermal cue" in capsys.readouterr().out
    assert not feel(capsys, "metal", "--object-c", "32.1")["thermal"]["thermal_cue"]


def test_a_contact_resistance_of_your_own_shapes_the_skin():
    tight = hapticvlm.feel("metal", contact_resistance=1e-4).skin_c
    loose = hapticvlm.feel("metal", contact_resistance=5e-3).skin_c
    assert tight[50] < loose[50] - 2.0


def test_the_vibration_is_described_with_its_spectrum(capsys):
    vibration = feel(capsys, "glass", "tap", "--seconds", "1")["vibration"]

    table = vibration["spectrum"]
    strongest = table["frequency_hz"][int(np.argmax(table["level_db"]))]
    assert 280 < strongest < 450
    assert vibration["modes"][0]["frequency_hz"] == 350
    assert vibration["share_1_to_1000_hz"] > 0.99
    assert 0.0 < vibration["rms"] < vibration["peak"] <= 1.0


def test_faster_rubbing_is_higher():
    def centre_hz(speed_mps: float) -> float:
        samples = sound(MATERIALS["fabric"], "slide", Motion(speed_mps, 1.0), 1.0).wave
        power = np.abs(np.fft.rfft(samples)) ** 2
        hertz = np.arange(power.size) * (RATE_HZ / samples.size)
        return float(np.sum(hertz * power) / np.sum(power))

    assert centre_hz(0.3) > 1.5 * centre_hz(0.15)


def test_a_touch_without_an_interaction_is_a_strike_and_then_a_rub():
    samples = np.abs(sound(MATERIALS["wood"], None, Motion(0.3, 1.0), 1.0).wave)

    assert samples[: RATE_HZ // 20].max() > 0.01
    assert samples[RATE_HZ * 35 // 100 : RATE_HZ * 39 // 100].max() < 0.01
    assert samples[RATE_HZ // 2 :].max() > 0.01


def test_silence_has_a_spectrum_too():
    levels, inside = spectrum(np.zeros(RATE_HZ, np.float32))
    assert max(levels) < -150.0
    assert inside == 1.0


def test_a_full_scale_sine_reads_zero_decibels():
    times = np.arange(RATE_HZ) / RATE_HZ
    levels, _ = spectrum(np.sin(2 * np.pi * 250.0 * times).astype(np.float32))
    assert max(levels) == pytest.approx(0.0, abs=0.1)


def test_picture_and_sound_are_written(tmp_path, capsys):
    picture, track = tmp_path / "touch.svg", tmp_path / "touch.wav"
    assert main(["feel", "metal", "--save", str(picture), "--save", str(track)]) == 0

    ElementTree.parse(picture)
    with wave.open(str(track)) as file:
        assert (file.getframerate(), file.getnchannels(), file.getnframes()) == (48000, 1, 240000)
    assert "limited by" in capsys.readouterr().out


def test_an_unknown_material_is_refused_naming_the_nearest(capsys):
    assert main(["feel", "woood"]) == 2
    said = capsys.readouterr()
    assert "nearest is `wood`" in said.err
    assert said.out == ""


@pytest.mark.parametrize(
    "wrong",
    [
        ["--object-c", "nan"],
        ["--speed", "-1"],
        ["--seconds", "inf"],
        ["--force", "x"],
    ],
)
def test_numbers_out_of_range_are_refused(wrong, capsys):
    with pytest.raises(SystemExit) as refused:
        main(["feel", "wood", *wrong])
    assert refused.value.code == 2
    assert wrong[0] in capsys.readouterr().err


@pytest.mark.parametrize("name", ["x.svg", "x.wav", "x.html"])
def test_a_file_that_cannot_be_written_is_said(name, tmp_path, capsys):
    assert main(["feel", "wood", "--seconds", "0.1", "--save", str(tmp_path / "no" / name)]) == 2
    assert "hapticvlm feel:" in capsys.readouterr().err


def test_a_format_that_is_not_known_is_refused_with_those_that_are(tmp_path, capsys):
    assert main(["feel", "wood", "--seconds", "0.1", "--save", str(tmp_path / "x.png")]) == 2
    assert ".svg" in capsys.readouterr().err


@pytest.mark.nightly
def test_it_draws_and_starts_without_the_heavy_libraries(tmp_path):
    code = (
        "import sys; from hapticvlm.commands.main import main; "
        "main(['feel', 'wood', '--json', '--save', sys.argv[1]]);"
        "heavy = {'torch', 'transformers', 'onnxruntime', 'matplotlib'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "touch.svg")]
    done = subprocess.run(command, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr
