"""Saved touches, read back by the public rules of each format, are what the speaker plays.

The readers here are written from the formats' documents and reference sources, not from our
writers: .haptic from facebook/meta-haptics-sdk (haptic_data, strict mode), .ahap from Apple's Core
Haptics pages.
"""

import json
import re
import wave

import numpy as np
import pytest

from hapticvlm.commands.main import main
from hapticvlm.materials import MATERIALS

RATE_HZ = 48_000
WINDOW_S = 0.02
LEAST = 10 ** (-40 / 20)  # of full scale: quieter windows are not compared
FOUR = ("wood", "glass", "fabric", "metal")
INTERACTIONS = ("strike", "slide", "tap", "carve")


def exported(tmp_path, material, interaction, kind, *more):
    path = tmp_path / f"touch.{kind}"
    arguments = ["feel", material, interaction, "--save", str(path), "--seconds", "1", *more]
    assert main(arguments) == 0
    return path


def played(tmp_path, material, interaction, *more):
    """Amplitude (sqrt 2 times rms) of each window of the speaker's own samples."""
    with wave.open(str(exported(tmp_path, material, interaction, "wav", *more))) as file:
        assert (file.getframerate(), file.getnchannels()) == (RATE_HZ, 1)
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32767.0
    return windows(np.sqrt(2.0) * samples)


def windows(amplitude):
    size = round(WINDOW_S * RATE_HZ)
    rows = np.asarray(amplitude)[: len(amplitude) // size * size].reshape(-1, size)
    return np.sqrt(np.mean(rows**2, axis=1))


def error_db(read, spoken):
    """Largest difference of level among the windows that can be felt."""
    size = min(len(read), len(spoken))
    loud = spoken[:size] > LEAST
    assert loud.any()
    return float(np.abs(20 * np.log10(read[:size][loud] / spoken[:size][loud])).max())


def lines(points, end_s):
    """Values between (time, value) points at RATE_HZ."""
    points = list(points)
    at = np.arange(round(end_s * RATE_HZ)) / RATE_HZ
    return np.interp(at, [time for time, _ in points], [value for _, value in points])


def read_haptic(path):
    """Amplitude at RATE_HZ. Fails by the rules of the strict validator."""
    document = json.loads(path.read_text())
    assert document["version"] == {"major": 1, "minor": 0, "patch": 0}
    envelopes = document["signals"]["continuous"]["envelopes"]
    amplitude = [(point["time"], point["amplitude"]) for point in envelopes["amplitude"]]
    frequency = [(point["time"], point["frequency"]) for point in envelopes["frequency"]]
    assert len(amplitude) >= 2
    for points in (amplitude, frequency):
        times = [time for time, _ in points]
        assert times == sorted(times)
        assert all(0.0 <= value <= 1.0 for _, value in points)
    assert amplitude[-1][0] > amplitude[0][0]
    assert amplitude[0][0] <= frequency[0][0]
    assert frequency[-1][0] <= amplitude[-1][0]
    return lines(amplitude, amplitude[-1][0])


def read_ahap(path):
    """Amplitude at RATE_HZ: intensity is felt quadratically. Fails by Core Haptics' limits."""
    document = json.loads(path.read_text())
    assert document["Version"] == 1.0
    curves: dict[str, list[tuple[float, float]]] = {
        "HapticIntensityControl": [],
        "HapticSharpnessControl": [],
    }
    ends = []
    for entry in document["Pattern"]:
        (kind,) = entry
        if kind == "Event":
            event = entry["Event"]
            assert event["EventType"] == "HapticContinuous"
            assert 0.0 < event["EventDuration"] <= 30.0
            given = {p["ParameterID"]: p["ParameterValue"] for p in event["EventParameters"]}
            assert given == {"HapticIntensity": 1.0, "HapticSharpness": 0.0}
            ends.append(event["Time"] + event["EventDuration"])
            continue
        curve = entry["ParameterCurve"]
        points = [
            (curve["Time"] + p["Time"], p["ParameterValue"])
            for p in curve["ParameterCurveControlPoints"]
        ]
        assert len(points) <= 16
        assert all(0.0 <= value <= 1.0 for _, value in points)
        before = curves[curve["ParameterID"]]
        if before:  # a curve goes on where the last one ended
            assert points[0] == pytest.approx(before[-1])
        before += points[1:] if before else points
    times = [time for time, _ in curves["HapticIntensityControl"]]
    assert times == sorted(times)
    assert max(ends) == pytest.approx(times[-1])
    return lines(curves["HapticIntensityControl"], times[-1]) ** 2


READERS = {"haptic": read_haptic, "ahap": read_ahap}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("material", FOUR)
def test_what_is_read_back_is_as_loud_as_what_the_speaker_plays(tmp_path, material, kind):
    errors = {}
    for interaction in INTERACTIONS:
        amplitude = READERS[kind](exported(tmp_path, material, interaction, kind))
        spoken = played(tmp_path, material, interaction)
        errors[interaction] = error_db(windows(amplitude), spoken)
    print(f"{material} as {kind}: at most {max(errors.values()):.2f} dB")
    assert max(errors.values()) < 1.0, errors


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("material", ["fabric", "glass"])
def test_on_the_scale_of_controllers_a_tap_is_felt_and_a_strike_leaves_room(
    tmp_path, material, kind
):
    found = {}
    for scale in ("palm", "controller"):
        path = exported(tmp_path, material, "tap", kind, "--scale", scale, "--speed", "0.3")
        found[scale] = windows(READERS[kind](path)).max()
    assert 0.1 <= found["controller"] <= 1.0
    assert found["controller"] > 1.5 * found["palm"]


def test_a_swing_is_exported_at_the_speed_at_which_feel_plays_it(tmp_path):
    usual = exported(tmp_path, "wood", "swing", "wav").read_bytes()
    fast = exported(tmp_path, "wood", "swing", "wav", "--speed", "5").read_bytes()
    slow = exported(tmp_path, "wood", "swing", "wav", "--speed", "0.3").read_bytes()

    assert usual == fast
    assert usual != slow


@pytest.mark.parametrize("kind", ["wav", "haptic", "ahap"])
def test_a_format_without_heat_gets_the_temperatures_in_a_file_beside_it(tmp_path, kind, capsys):
    path = exported(tmp_path, "metal", "slide", kind, "--object-c", "5", "--seconds", "4")
    heat = json.loads(path.with_name(path.name + ".heat.json").read_text())
    assert heat["surface_c"] == 5.0
    assert heat["setpoint_c"][-1] < 24.0
    assert len(heat["time_s"]) == len(heat["setpoint_c"]) == len(heat["skin_c"])
    assert str(path) + ".heat.json" in capsys.readouterr().out


def test_a_long_touch_is_cut_into_events_that_core_haptics_plays(tmp_path):
    path = exported(tmp_path, "fabric", "slide", "ahap", "--seconds", "31")
    assert read_ahap(path).size == pytest.approx(31 * RATE_HZ, abs=RATE_HZ * 0.02)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_is_a_file_that_is_as_loud_as_the_speaker(name, tmp_path):
    amplitude = read_haptic(exported(tmp_path, name, "tap", "haptic", "--seconds", "0.1"))
    assert error_db(windows(amplitude), played(tmp_path, name, "tap", "--seconds", "0.1")) < 1.0


def test_a_page_of_all_has_a_section_for_each_material(tmp_path, capsys):
    path = tmp_path / "all.html"
    assert main(["feel", "all", "tap", "--seconds", "0.1", "--save", str(path)]) == 0
    sections = re.findall(r'<section data-material="(\w+)"', path.read_text(encoding="utf-8"))
    assert sections == list(MATERIALS)
    assert "11 touches" in capsys.readouterr().out


@pytest.mark.parametrize("more", [(), ("--save", "all.wav"), ("--save", "all.html", "--json")])
def test_all_materials_are_one_page_and_nothing_else(more, capsys):
    assert main(["feel", "all", *more]) == 2
    said = capsys.readouterr()
    assert "--save FILE.html" in said.out + said.err


def test_a_voice_for_an_actuator_is_refused(tmp_path, capsys):
    assert main(["feel", "wood", "--voice", "sound", "--save", str(tmp_path / "x.ahap")]) == 2
    assert "--voice" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
