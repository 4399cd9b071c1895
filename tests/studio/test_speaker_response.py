"""A speaker's curve: measured from a recording, kept in a file, undone where waveforms are made."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import soundfile
from each_case import each_row
from numpy.typing import NDArray
from pace import PACE
from word_tables import words

from hapticvlm.commands.main import main
from hapticvlm.devices.speaker.speaker_files import SpeakerResponse, read_response, write_response
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm_studio.calibration import speaker_response as measured
from hapticvlm_studio.calibration.output import FADE_S, WavePlayer
from hapticvlm_studio.calibration.speaker_response import (
    read_csv,
    response,
    simulated_speaker,
    sweep,
)
from hapticvlm_studio.commands import calibrate_speaker

pytestmark = pytest.mark.process

Floats = NDArray[np.float64]
PATIENCE_S = 10.0 * PACE


def levels(found: SpeakerResponse) -> dict[float, float]:
    return dict(zip(np.round(found.frequency_hz), found.response_db, strict=True))


def played() -> Floats:
    return sweep().astype(np.float64)


def test_a_speaker_that_plays_all_alike_has_a_flat_curve_at_any_delay_and_level() -> None:
    late = np.concatenate((np.zeros(31_337), 0.01 * played(), np.zeros(9_999)))
    for recorded in (played(), late):
        found = response(recorded, RATE_HZ)
        assert np.abs(found.response_db).max() < 0.2


def test_a_resonant_speaker_is_measured_as_it_is_in_noise_too() -> None:
    moved = simulated_speaker(played())
    clean = levels(response(moved, RATE_HZ))
    assert clean[397.0] == pytest.approx(clean[250.0] + 4.2, abs=0.3)
    noise = np.random.default_rng(1).normal(0.0, 0.05 * moved.std(), moved.size)
    for hz, db in levels(response(moved + noise, RATE_HZ)).items():
        if hz >= 40:
            assert db == pytest.approx(clean[hz], abs=1.0)


@pytest.mark.parametrize(
    ("recorded", "rate_hz", "said"),
    [
        (np.zeros(11 * RATE_HZ), RATE_HZ, "silent"),
        (np.random.default_rng(0).normal(size=11 * RATE_HZ), RATE_HZ, "sweep not found"),
        (np.zeros(RATE_HZ), RATE_HZ, "whole sweep"),
        (np.full(11 * RATE_HZ, np.nan), RATE_HZ, "not numbers"),
        (np.ones(11_000), 1_000, "needs 2500"),
    ],
)
def test_a_recording_that_is_none_is_refused(recorded: Floats, rate_hz: int, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        response(recorded, rate_hz)


def test_the_file_says_what_was_measured(tmp_path: Path) -> None:
    path = tmp_path / "speaker.toml"
    given = SpeakerResponse((20.0, 250.0, 1000.0), (-30.0, 0.0, 4.0), simulated=True)
    write_response(path, given)
    assert read_response(path) == given
    assert read_response(path).playback().full_scale_db == NOMINAL.full_scale_db
    of_a_hand = replace(given, full_scale_db=38.5)
    write_response(path, of_a_hand)
    assert read_response(path) == of_a_hand


@each_row(("text", "said"), words(Path(__file__).with_name("wrong.csv"), "speaker"))
def test_a_wrong_file_is_refused_with_the_field(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "speaker.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=said):
        read_response(path)


def test_a_correction_is_bounded_and_leaves_250_hz_alone() -> None:
    given = SpeakerResponse((10.0, 40.0, 250.0, 500.0, 2000.0), (-90.0, -30.0, 3.0, 8.0, 80.0))
    needs = given.correction()
    assert needs.frequency_hz == (40.0, 250.0, 500.0)
    assert needs.gain_db == (12.0, 0.0, -5.0)
    assert needs.gain(1.0) == pytest.approx(10 ** (12 / 20))


def test_corrected_waveforms_move_a_resonant_speaker_as_plain_ones_move_an_even_one() -> None:
    needs = response(simulated_speaker(played()), RATE_HZ).correction()
    playback = Playback(correction=needs)
    motion = Motion(0.1, 0.0)
    for name, material in MATERIALS.items():
        facts = material.vibration
        meant = impact(facts, "strike", Motion(0.5, 1.0), 0)
        given = impact(facts, "strike", Motion(0.5, 1.0), 0, playback)
        assert given[0] == pytest.approx(0.0, abs=1e-6)
        assert off_db(given, meant) < 0.7, name
        rubs = Texture(facts, "slide", 1), Texture(facts, "slide", 1, playback)
        plain, corrected = (rub.render(RATE_HZ, motion) for rub in rubs)
        assert off_db(corrected, plain) < 1.5, name  # 1.3 for stone, whose grains are the sharpest
    glass = MATERIALS["glass"].vibration
    plain = impact(glass, "strike", Motion(0.5, 1.0), 0)
    assert off_db(plain, plain) > 2.0  # what was there to correct


def off_db(given: NDArray[np.float32], meant: NDArray[np.float32]) -> float:
    """How far the simulated speaker's movement by `given` is off `meant`, in energy."""
    size = 2 * RATE_HZ
    moved = simulated_speaker(np.pad(given.astype(np.float64), (0, size - given.size)))
    return abs(float(10 * np.log10(np.sum(moved**2) / np.sum(meant.astype(float) ** 2))))


def test_the_command_measures_a_wav_and_a_csv_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = simulated_speaker(played())
    soundfile.write(tmp_path / "recorded.wav", 0.4 * moved, RATE_HZ)
    few = moved[::12]
    rows = [f"{i * 12 / RATE_HZ:.6f},{value:.8f}" for i, value in enumerate(few)]
    (tmp_path / "recorded.csv").write_text("time_s,acceleration\n" + "\n".join(rows) + "\n")
    curves = []
    for name in ("recorded.wav", "recorded.csv"):
        out = str(tmp_path / "curve.toml")
        asked = ["calibrate", "speaker", "--recorded", str(tmp_path / name), "--out", out]
        assert main([*asked, "--json"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert not told["simulated"]
        assert read_response(Path(out)).response_db == pytest.approx(told["response_db"])
        curves.append(told["response_db"])
    assert np.abs(np.subtract(*curves))[:-2].max() < 0.5


def exported(separator: str, decimal: str, unit_s: float, *, bom: bool = False) -> str:
    """What a phone saves of a sweep in z: time, three axes with gravity, and their magnitude."""
    step = 12
    moved = simulated_speaker(played())[::step]
    z = 9.81 + 0.4 * moved / np.abs(moved).max()
    x = 0.01 * np.random.default_rng(2).normal(size=z.size)
    rows = np.column_stack([np.arange(z.size) * step / RATE_HZ / unit_s, x, x, z, np.hypot(x, z)])
    lines = [separator.join(f"{value:.9g}".replace(".", decimal) for value in row) for row in rows]
    header = separator.join(f'"{name}"' for name in ("Time", "x", "y", "Linear z", "Absolute"))
    return ("\ufeff" if bom else "") + "\r\n".join([header, *lines]) + "\r\n"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("separator", "decimal", "unit_s", "bom"),
    [
        (",", ".", 1.0, True),
        (";", ",", 1.0, False),
        ("\t", ".", 1e-3, False),
        (";", ".", 1e-9, True),
    ],
)
def test_the_axis_that_moves_most_is_read_from_what_phones_export(
    tmp_path: Path, separator: str, decimal: str, unit_s: float, bom: bool
) -> None:
    path = tmp_path / "phone.csv"
    path.write_text(exported(separator, decimal, unit_s, bom=bom), encoding="utf-8", newline="")
    recording = read_csv(path)

    assert recording.column == "Linear z"
    assert recording.rate_hz == pytest.approx(4000.0, rel=1e-3)
    expected = response(simulated_speaker(played()), RATE_HZ).response_db
    measured = response(recording.values, recording.rate_hz).response_db
    assert np.abs(np.subtract(measured, expected))[:-2].max() < 0.5


def test_a_simulated_speaker_is_called_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "speaker", "--simulate"]) == 0
    assert "simulated" in capsys.readouterr().out.splitlines()[0]
    assert main(["calibrate", "speaker", "--simulate", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["simulated"]


def test_a_missing_recording_or_output_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    for option, said in (("--recorded", "none.wav: no such file"), ("--speaker", "")):
        assert main(["calibrate", "speaker", option, "none.wav"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert said in line


def test_the_sweep_is_played_at_its_level_after_a_countdown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(measured, "SWEEP_S", 0.5)
    monkeypatch.setattr(calibrate_speaker, "COUNTDOWN_S", 1)
    asked = ["calibrate", "speaker", "--speaker", "simulated"]
    assert main([*asked, "--level", "0.25"]) == 0
    told = capsys.readouterr().out
    assert "start recording" in told
    assert "\n  1\n" in told
    assert "played 1.5 s at level 0.25" in told
    with pytest.raises(SystemExit):
        main([*asked, "--level", "1.5"])


@contextmanager
def playing(output: WavePlayer, wave: NDArray[np.float32]) -> Iterator[None]:
    """Play a waveform in a thread, while the test asks for its samples."""
    thread = threading.Thread(target=output.play, args=(wave,))
    thread.start()
    while output._waveform.samples.size != wave.size:
        time.sleep(0.001)
    yield
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_a_waveform_is_played_whole_within_its_range_and_then_nothing() -> None:
    wave = 2.0 * np.sin(np.arange(3000) / 50.0).astype(np.float32)
    output = WavePlayer("simulated")
    with playing(output, wave):
        played = np.concatenate([output.fill(512) for _ in range(8)])
    assert np.array_equal(played[:3000], np.clip(wave, -1.0, 1.0))
    assert not played[3000:].any()


def test_what_is_broken_off_fades_without_a_step() -> None:
    output = WavePlayer("simulated")
    with playing(output, np.full(48_000, 0.5, np.float32)):
        before = output.fill(512)
        output._aim = 0.0
        after = np.concatenate([output.fill(512) for _ in range(8)])
    heard = np.concatenate((before[-1:], after))
    assert np.abs(np.diff(heard)).max() < 0.5 / (0.9 * FADE_S * RATE_HZ)
    assert not after[round(FADE_S * RATE_HZ) + 1 :].any()


class Interrupting:
    """Samples during whose conversion the output asks for the next block."""

    def __init__(self, output: WavePlayer, samples: NDArray[np.float32]) -> None:
        self.size = samples.size
        self._output, self._samples = output, samples

    def __array__(self, dtype: object = None, copy: object = None) -> NDArray[np.float32]:
        self._output.fill(512)
        return self._samples


def test_a_waveform_is_waited_for_when_the_output_asks_at_the_moment_it_is_given() -> None:
    output = WavePlayer("simulated")
    ended = threading.Event()

    def play() -> None:
        output.play(cast("NDArray[np.float32]", Interrupting(output, np.ones(1000, np.float32))))
        ended.set()

    thread = threading.Thread(target=play)
    thread.start()
    assert not ended.wait(0.2)  # nothing has asked for its samples
    assert output.fill(1000).all()
    assert ended.wait(PATIENCE_S)
    thread.join()


AT_ONCE = """
import sys
from hapticvlm.__main__ import run
from hapticvlm_studio.commands import calibrate_speaker
calibrate_speaker.COUNTDOWN_S = 0
sys.exit(run())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C as a signal is of Unix")
def test_ctrl_c_ends_the_sweep() -> None:
    # Whoever runs this in the background hands on a SIGINT that is ignored; a terminal does not.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    command = [sys.executable, "-c", AT_ONCE, "calibrate", "speaker", "--speaker", "simulated"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:  # type: ignore[call-overload]
        assert "start recording" in process.stdout.readline()
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        assert "stopped" in process.communicate(timeout=60.0)[1]
    assert process.returncode == 130
