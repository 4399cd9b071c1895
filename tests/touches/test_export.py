"""Saved touches, read back by the public rules of each format, are what the speaker plays.

The readers here are written from the formats' documents and reference sources, not from our
writers: .haptic from facebook/meta-haptics-sdk (haptic_data, strict mode), .ahap from Apple's Core
Haptics pages, .hjif from MPEGGroup/HapticReferenceSoftware (IOJson, semantic checks).
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


def samples_of(tmp_path, material, interaction):
    """The speaker's own samples."""
    with wave.open(str(exported(tmp_path, material, interaction, "wav"))) as file:
        assert (file.getframerate(), file.getnchannels()) == (RATE_HZ, 1)
        return np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32767.0


def played(tmp_path, material, interaction):
    """Amplitude (sqrt 2 times rms) of each window of the speaker's own samples."""
    return windows(np.sqrt(2.0) * samples_of(tmp_path, material, interaction))


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


def read_hjif(path):
    """Amplitude at RATE_HZ, temperatures (s, degC) and tones. Fails by the reference's checks."""
    document = json.loads(path.read_text())
    needed = {"version", "profile", "level", "date", "description", "timescale"}
    assert needed | {"avatars", "perceptions", "syncs"} <= set(document)
    assert re.fullmatch(r"\d{4}(-\d)?", document["version"])
    assert int(document["version"][:4]) >= 2023
    assert (document["profile"], document["level"]) == ("Main", 1)
    assert re.fullmatch(r"\d{4}-[01]\d-[0-3]\d", document["date"])
    assert 0 < document["timescale"] <= 48_000
    ids = [perception["id"] for perception in document["perceptions"]]
    assert len(set(ids)) == len(ids)
    channels = [each for perception in document["perceptions"] for each in perception["channels"]]
    ids = [channel["id"] for channel in channels]
    assert len(set(ids)) == len(ids)  # the decoder of the binary form aborts on an id twice
    found = {}
    for perception in document["perceptions"]:
        assert "effect_semantic_scheme" not in perception  # the reference refuses every value
        assert perception["effect_library"] == []
        (channel,) = perception["channels"]
        for name in ("id", "description", "gain", "mixing_coefficient", "body_part_mask"):
            assert name in channel, name
        assert 1 <= len(channel["bands"]) <= 7  # the most of level 1
        for band in channel["bands"]:
            check_band(band)
        # The binary form has 8 bits for an amplitude, so the largest uses all of them.
        levels = [f["amplitude_modulation"] for b in channel["bands"] for f in keyframes_of(b)]
        assert max(map(abs, levels)) == 1.0
        assert 0.0 < channel["gain"] <= 1.0
        found[perception["perception_modality"]] = perception
    scale = document["timescale"]
    tones = read_tones(found["Vibrotactile"]["channels"][0], scale)
    amplitude = np.sqrt(sum(level**2 for level, _ in tones))
    return amplitude, temperatures(found["Temperature"], scale), tones


def read_tones(channel, scale):
    """Amplitude and frequency at RATE_HZ of each band; the decoder adds them up."""
    tones = []
    for band in channel["bands"]:
        low, high = band["lower_frequency_limit"], band["upper_frequency_limit"]
        keyframes = keyframes_of(band)
        assert all(low <= frame["frequency_modulation"] <= high for frame in keyframes)
        at_s = [frame["relative_position"] / scale for frame in keyframes]
        levels = [channel["gain"] * frame["amplitude_modulation"] for frame in keyframes]
        hertz = [frame["frequency_modulation"] for frame in keyframes]
        both = (lines(zip(at_s, values, strict=True), at_s[-1]) for values in (levels, hertz))
        tones.append(tuple(both))
    return tones


def keyframes_of(band):
    (effect,) = band["effects"]
    return effect["keyframes"]


def check_band(band):
    low, high = band["lower_frequency_limit"], band["upper_frequency_limit"]
    assert isinstance(low, int)
    assert isinstance(high, int)
    assert low <= high
    assert ("curve_type" in band) == (band["band_type"] == "Curve")
    (effect,) = band["effects"]
    assert (effect["effect_type"], effect["position"]) == ("Basis", 0)
    times = [frame["relative_position"] for frame in effect["keyframes"]]
    assert times == sorted(set(times))
    assert all(isinstance(time, int) for time in times)


def temperatures(perception, scale):
    (band,) = perception["channels"][0]["bands"]
    keyframes = keyframes_of(band)
    assert band["band_type"] == "Curve"
    assert len(keyframes) >= 3  # of two the reference decoder makes silence
    told = re.search(r"degC = ([\d.]+) \+ ([\d.]+) x value", perception["description"])
    assert told is not None
    zero, span = map(float, told.groups())
    span *= perception["channels"][0]["gain"]
    return [
        (frame["relative_position"] / scale, zero + span * frame["amplitude_modulation"])
        for frame in keyframes
    ]


READERS = {"haptic": read_haptic, "ahap": read_ahap, "hjif": lambda path: read_hjif(path)[0]}


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


def test_tones_that_sound_together_never_add_up_to_more_than_full_scale(tmp_path):
    fast = ("--scale", "controller", "--speed", "1")
    *_, tones = read_hjif(exported(tmp_path, "fabric", "carve", "hjif", *fast))
    assert 0.9 < sum(level for level, _ in tones).max() <= 1.001  # four digits in the file


def test_a_swing_is_exported_at_the_speed_at_which_feel_plays_it(tmp_path):
    usual = exported(tmp_path, "wood", "swing", "wav").read_bytes()
    fast = exported(tmp_path, "wood", "swing", "wav", "--speed", "5").read_bytes()
    slow = exported(tmp_path, "wood", "swing", "wav", "--speed", "0.3").read_bytes()

    assert usual == fast
    assert usual != slow


def octaves_db(samples):
    """Energy of each octave from 20 to 640 Hz, dB."""
    energy = np.abs(np.fft.rfft(samples)) ** 2
    hertz = np.fft.rfftfreq(len(samples), 1.0 / RATE_HZ)
    lowest = 20.0 * 2.0 ** np.arange(5)
    parts = [energy[(hertz >= low) & (hertz < 2.0 * low)].sum() for low in lowest]
    return 10.0 * np.log10(parts)


@pytest.mark.parametrize("material", ["wood", "leather", "fabric"])
def test_every_octave_of_a_strike_is_in_the_format_that_holds_several_tones(tmp_path, material):
    """Within 6 dB where it is heard at all; of one tone, octaves were off by 7 to 16 dB."""
    *_, tones = read_hjif(exported(tmp_path, material, "strike", "hjif"))
    summed = sum(level * np.sin(2.0 * np.pi * np.cumsum(hertz) / RATE_HZ) for level, hertz in tones)
    spoken = samples_of(tmp_path, material, "strike")
    size = min(len(summed), len(spoken))
    ours, theirs = octaves_db(summed[:size]), octaves_db(spoken[:size])
    heard = theirs > theirs.max() - 20.0
    assert np.abs(ours - theirs)[heard].max() < 6.0, ours - theirs


def test_the_frequencies_tell_materials_apart(tmp_path):
    """Glass rings higher than wood, in the one format that holds hertz."""
    middles = {}
    for material in ("wood", "glass"):
        document = json.loads(exported(tmp_path, material, "strike", "hjif").read_text())
        bands = document["perceptions"][0]["channels"][0]["bands"]
        first = [frame for band in bands for frame in keyframes_of(band)[:20]]
        hertz = [frame["frequency_modulation"] for frame in first]
        middles[material] = np.average(hertz, weights=[f["amplitude_modulation"] for f in first])
    assert middles["glass"] > 1.15 * middles["wood"]


@pytest.mark.parametrize("kind", ["wav", "haptic", "ahap"])
def test_a_format_without_heat_gets_the_temperatures_in_a_file_beside_it(tmp_path, kind, capsys):
    path = exported(tmp_path, "metal", "slide", kind, "--object-c", "5", "--seconds", "4")
    heat = json.loads(path.with_name(path.name + ".heat.json").read_text())
    assert heat["surface_c"] == 5.0
    assert heat["setpoint_c"][-1] < 24.0
    assert len(heat["time_s"]) == len(heat["setpoint_c"]) == len(heat["skin_c"])
    assert str(path) + ".heat.json" in capsys.readouterr().out


def test_mpeg_holds_the_temperatures_itself(tmp_path):
    path = exported(tmp_path, "metal", "slide", "hjif", "--object-c", "5", "--seconds", "4")
    _, found, _ = read_hjif(path)
    assert found[0][1] > 24.0  # the plate has led a little, and goes on
    assert found[-1][1] < 24.0
    assert all(18.0 <= celsius <= 40.0 for _, celsius in found)
    assert not path.with_name(path.name + ".heat.json").exists()


def test_eight_bits_keep_the_level_of_a_weak_swing(tmp_path):
    """The binary form stores -1..1 in 8 bits; a swing of 0.005 would be 14 dB too strong."""
    path = exported(tmp_path, "metal", "swing", "hjif")
    document = json.loads(path.read_text())
    for perception in document["perceptions"]:
        for band in perception["channels"][0]["bands"]:
            for frame in keyframes_of(band):
                level = round(127.5 * (frame["amplitude_modulation"] + 1.0))
                frame["amplitude_modulation"] = level / 127.5 - 1.0
    path.write_text(json.dumps(document))
    amplitude, _, _ = read_hjif(path)
    spoken = played(tmp_path, "metal", "swing")
    assert windows(amplitude).max() / spoken.max() == pytest.approx(1.0, abs=0.03)


def test_a_long_touch_is_cut_into_events_that_core_haptics_plays(tmp_path):
    path = exported(tmp_path, "fabric", "slide", "ahap", "--seconds", "31")
    assert read_ahap(path).size == pytest.approx(31 * RATE_HZ, abs=RATE_HZ * 0.02)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_is_a_file_that_can_be_read(name, tmp_path):
    read_haptic(exported(tmp_path, name, "tap", "haptic", "--seconds", "0.1"))


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


def test_a_material_that_is_not_known_is_refused_with_the_nearest(tmp_path, capsys):
    assert main(["feel", "wod", "--save", str(tmp_path / "x.wav")]) == 2
    assert "nearest is `wood`" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
