"""Computes a speaker's response from a sweep and an accelerometer's recording of it.

The speaker plays a sweep x(t) whose frequency rises exponentially from 12 to 1200 Hz in 10 s (the
method of Farina, 2000; unchecked), and the accelerometer records y(t). The spectrum of the impulse
response is Y / X, computed as

    H = Y X* / (|X|^2 + eps max |X|^2)

where eps keeps frequencies that the sweep does not contain from being divided by nothing. Back in
time, H is one short peak, at whatever moment the recording was started. So playback and recording
need not be synchronised.

Everything further than GATE_S from the peak is cut. That removes noise, and also the distortion of
the speaker: with an exponential sweep the n-th harmonic of f sounds T ln n / ln(1200 / 12) before
the sweep itself arrives at n f, so its response stands that long before the peak (1.5 s for n = 2,
computed), far outside of the gate. The response is the level of the rest in third octaves.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.devices.speaker.speaker_files import SpeakerResponse
from hapticvlm.rendering.vibration.equaliser import REFERENCE_HZ
from hapticvlm.rendering.vibration.patterns import resampled
from hapticvlm.rendering.vibration.vibration import RATE_HZ

_Floats = NDArray[np.float64]

SWEEP_HZ = (12.0, 1200.0)
SWEEP_S = 10.0
SILENCE_S = 0.5
LEVEL = 0.5
LONGEST_S = 120.0
MAX_BYTES = 256 * documents.MIB  # of a recording in a CSV file
THIRDS_HZ = tuple(1000.0 * 2.0 ** (third / 3.0) for third in range(-17, 1))  # 20 to 1000 Hz
GATE_S = 0.25
FADE_S = 0.1
MIN_CONTRAST_DB = 15.0  # of the gated response over the rest; noise alone gives 6, no noise 140
MIN_RATE_HZ = 2_500.0  # more than twice the highest third octave
MIN_COLUMNS = 2  # of a recording: time and a value
UNITS_S = (1.0, 1e-3, 1e-6, 1e-9)  # of its clock
ALIKE = 0.02  # share by which two columns may vary differently and still count as equal


def sweep() -> NDArray[np.float32]:
    """Return the sweep to play, (N,) float32 at RATE_HZ, with SILENCE_S before and after."""
    count = int(SWEEP_S * RATE_HZ)
    low, high = SWEEP_HZ
    # f(t) = low exp(rate t / T): every octave takes the same time and so gets the same energy. The
    # phase is the integral of 2 pi f.
    rate = math.log(high / low)
    time = np.arange(count) / count
    wave = np.sin(2.0 * math.pi * low * SWEEP_S / rate * np.expm1(time * rate))
    edge = int(FADE_S * RATE_HZ)
    fade = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, edge))
    wave[:edge] *= fade
    wave[-edge:] *= fade[::-1]
    silence = np.zeros(int(SILENCE_S * RATE_HZ))
    return np.concatenate((silence, LEVEL * wave, silence)).astype(np.float32)


def response(recorded: _Floats, rate_hz: float, *, simulated: bool = False) -> SpeakerResponse:
    """Return the response from a recording of the sweep, 0 dB at 250 Hz.

    `recorded` is (N,) float64, an acceleration in any unit, in which an ideal speaker is flat above
    its resonance (perception.py). Raises ValueError when it is too slow, too short or too long,
    silent, or does not contain the sweep.
    """
    wave = _checked(recorded, rate_hz)
    played = sweep().astype(np.float64)
    # Padded to the length of the linear convolution, so that the end does not wrap to the start.
    size = 1 << (wave.size + played.size - 1).bit_length()
    sent = np.fft.rfft(played, size)
    received = np.fft.rfft(wave, size)
    power = np.abs(sent) ** 2
    impulse = np.fft.irfft(received * np.conj(sent) / (power + 1e-4 * power.max()), size)
    gated = _gated(impulse)
    hertz = np.arange(size // 2 + 1) * (RATE_HZ / size)
    transfer = np.abs(np.fft.rfft(gated))
    edge = 2.0 ** (1.0 / 6.0)
    bands = [transfer[(hertz >= hz / edge) & (hertz < hz * edge)] for hz in THIRDS_HZ]
    levels_db = np.array([10.0 * math.log10(float(np.mean(band**2)) + 1e-30) for band in bands])
    reference_db = np.interp(math.log(REFERENCE_HZ), np.log(THIRDS_HZ), levels_db)
    levels = tuple(float(level) for level in np.clip(levels_db - reference_db, -120.0, 120.0))
    return SpeakerResponse(THIRDS_HZ, levels, simulated)


@dataclass(frozen=True, slots=True)
class Recording:
    """An accelerometer's values, (N,) evenly spaced, their rate, and the column they stood in."""

    values: _Floats
    rate_hz: float
    column: str


def read_csv(path: Path) -> Recording:
    """Read what phones and microcontrollers export.

    The file has rows of time and values, with or without a first row of names, separated by commas,
    semicolons or tabs, and with a decimal point or comma. Of several values the one that moves most
    counts. The time may be in s, ms, us or ns. Raises OSError, and ValueError which names the file
    and the fault.
    """
    try:
        content = documents.read_text(path, MAX_BYTES)
    except ValueError as error:
        raise ValueError(f"{path}: {documents.reason(error)}") from None
    names, rows = _table(content)
    try:
        numbers = np.array([[float(cell) for cell in row] for row in rows])
    except ValueError as error:
        raise ValueError(
            f"{path}: {documents.reason(error)}; needs rows of time and acceleration"
        ) from None
    if numbers.shape[0] < 100:
        raise ValueError(
            f"{path}: {numbers.shape[0]} rows; needs at least 100 of time and acceleration"
        )
    time_s = numbers[:, 0] * _seconds(float(numbers[-1, 0] - numbers[0, 0]))
    steps = np.diff(time_s)
    if not np.isfinite(numbers).all() or float(steps.min()) <= 0.0:
        raise ValueError(f"{path}: timestamps must increase and every value must be a number")
    column = _most_moving(numbers)
    # The clock of a phone or a microcontroller jitters and drops samples; the median step is its
    # rate all the same, and the values are interpolated to even steps of it.
    rate_hz = 1.0 / float(np.median(steps))
    even = np.arange(time_s[0], time_s[-1], 1.0 / rate_hz)
    values = np.asarray(np.interp(even, time_s, numbers[:, column]))
    return Recording(values, rate_hz, names[column] if names else f"column {column + 1}")


def simulated_speaker(played: _Floats) -> _Floats:
    """Return the acceleration of a small simulated driver, (N,), from the wave it plays.

    It resonates at 55 Hz with Q = 1.2, falls by 12 dB per octave below, and has a peak at 400 Hz.
    """
    hertz = np.arange(played.size // 2 + 1) * (RATE_HZ / played.size)
    resonance = (1j * hertz / 55.0) ** 2 / (1.0 - (hertz / 55.0) ** 2 + 1j * hertz / 55.0 / 1.2)
    bump = 1.0 + 1.0 / (1.0 + 1j * 3.0 * (hertz / 400.0 - 400.0 / np.maximum(hertz, 1e-9)))
    at_reference = np.interp(REFERENCE_HZ, hertz, np.abs(resonance * bump))
    moved = np.fft.rfft(played) * resonance * bump / at_reference
    return np.asarray(np.fft.irfft(moved, played.size))


def _table(content: str) -> tuple[list[str], list[list[str]]]:
    """Return the names of the columns, if any, and the rows with decimal points."""
    lines = [line for line in content.splitlines() if line.strip()]
    last = lines[-1] if lines else ""
    separator = next((mark for mark in ";\t" if mark in last), ",")
    rows = [row for row in csv.reader(lines, delimiter=separator) if len(row) >= MIN_COLUMNS]
    if separator != ",":
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    names = rows.pop(0) if rows and not _is_number(rows[0][0]) else []
    width = min((len(row) for row in rows), default=0)
    return names, [row[:width] for row in rows]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _seconds(duration: float) -> float:
    """Return the unit of a clock, s: the first in which the recording is not too long."""
    return next((unit for unit in UNITS_S if duration * unit <= LONGEST_S), UNITS_S[-1])


def _most_moving(numbers: _Floats) -> int:
    """Return the column that varies most; one that only ever grows is a clock.

    Of columns that vary alike, such as an axis and the magnitude of all three, the first counts.
    """
    varies = numbers.std(axis=0)
    varies[(np.diff(numbers, axis=0) > 0.0).all(axis=0)] = 0.0
    varies[0] = -1.0
    return int(np.argmax(varies >= (1.0 - ALIKE) * varies.max()))


def _checked(recorded: _Floats, rate_hz: float) -> _Floats:
    if rate_hz < MIN_RATE_HZ:
        raise ValueError(f"recorded at {rate_hz:.0f} Hz; needs {MIN_RATE_HZ:.0f} Hz or more")
    if not SWEEP_S <= recorded.size / rate_hz <= LONGEST_S:
        seconds = recorded.size / rate_hz
        raise ValueError(
            f"the recording lasts {seconds:.3g} s; it needs the whole sweep, {SWEEP_S:g} s, and at "
            f"most {LONGEST_S:g} s"
        )
    if not np.isfinite(recorded).all():
        raise ValueError("the recording contains values that are not numbers")
    wave = recorded - recorded.mean()
    peak = float(np.abs(wave).max())
    if peak == 0.0:
        raise ValueError("the recording is silent; was the speaker on?")
    return resampled(wave / peak, round(rate_hz))


def _gated(impulse: _Floats) -> _Floats:
    """Return the impulse response around its peak. Raises ValueError where nothing stands out."""
    peak = int(np.argmax(np.abs(impulse)))
    # The peak is moved to the middle, so that the gate needs no case for a peak near either end.
    rolled = np.roll(impulse, impulse.size // 2 - peak)
    away_s = np.abs(np.arange(impulse.size) - impulse.size // 2) / RATE_HZ
    gate = np.clip((GATE_S - away_s) / (0.5 * GATE_S), 0.0, 1.0)
    inside = rolled[away_s < GATE_S]
    outside = rolled[away_s >= GATE_S]
    contrast = np.mean(inside**2) / max(float(np.mean(outside**2)), 1e-30)
    if 10.0 * math.log10(float(contrast)) < MIN_CONTRAST_DB:
        raise ValueError("sweep not found (too much noise?); play it louder and record it again")
    return np.asarray(rolled * gate)
