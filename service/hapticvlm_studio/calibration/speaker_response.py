"""A speaker's response from a sweep and what an accelerometer made of it.

The recording is divided by the sweep, which gives an impulse response at whatever time the
recording was begun; what lies further than GATE_S from its peak is noise and is cut. Third octaves
of what is left are the response.
"""

from __future__ import annotations

import csv
import io
import math
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
MOST_BYTES = 256 * documents.MIB  # of a recording as text
THIRDS_HZ = tuple(1000.0 * 2.0 ** (third / 3.0) for third in range(-17, 1))  # 20 to 1000 Hz
GATE_S = 0.25
FADE_S = 0.1
LEAST_CONTRAST_DB = 15.0  # of the gated response over the rest; noise alone gives 6, none of it 140
LEAST_RATE_HZ = 2_500.0  # a thousand hertz need more than twice that
QUANTITIES = {"acceleration": 0, "velocity": 1, "displacement": 2}  # derivatives still to take


def sweep() -> NDArray[np.float32]:
    """Make the sweep to play, (N,) float32 at RATE_HZ: logarithmic, silence around it."""
    count = int(SWEEP_S * RATE_HZ)
    low, high = SWEEP_HZ
    rate = math.log(high / low)
    time = np.arange(count) / count
    wave = np.sin(2.0 * math.pi * low * SWEEP_S / rate * np.expm1(time * rate))
    edge = int(FADE_S * RATE_HZ)
    fade = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, edge))
    wave[:edge] *= fade
    wave[-edge:] *= fade[::-1]
    silence = np.zeros(int(SILENCE_S * RATE_HZ))
    return np.concatenate((silence, LEVEL * wave, silence)).astype(np.float32)


def response(
    recorded: _Floats, rate_hz: float, quantity: str = "acceleration", *, simulated: bool = False
) -> SpeakerResponse:
    """Compute the response from a recording (N,) of the sweep. Raises ValueError."""
    wave = _checked(recorded, rate_hz)
    played = sweep().astype(np.float64)
    size = 1 << (wave.size + played.size - 1).bit_length()
    given = np.fft.rfft(played, size)
    received = np.fft.rfft(wave, size)
    power = np.abs(given) ** 2
    impulse = np.fft.irfft(received * np.conj(given) / (power + 1e-4 * power.max()), size)
    gated = _gated(impulse)
    hertz = np.arange(size // 2 + 1) * (RATE_HZ / size)
    transfer = np.abs(np.fft.rfft(gated)) * hertz ** QUANTITIES[quantity]
    edge = 2.0 ** (1.0 / 6.0)
    bands = [transfer[(hertz >= hz / edge) & (hertz < hz * edge)] for hz in THIRDS_HZ]
    levels_db = np.array([10.0 * math.log10(float(np.mean(band**2)) + 1e-30) for band in bands])
    reference_db = np.interp(math.log(REFERENCE_HZ), np.log(THIRDS_HZ), levels_db)
    levels = tuple(float(level) for level in np.clip(levels_db - reference_db, -120.0, 120.0))
    return SpeakerResponse(THIRDS_HZ, levels, simulated)


def read_csv(path: Path) -> tuple[_Floats, float]:
    """Read an accelerometer's time in s and value: (N,) evenly spaced, and its rate, Hz.

    A first line of names is skipped; further columns are ignored. Raises OSError, ValueError.
    """
    try:
        text = documents.read_text(path, MOST_BYTES)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    rows = [row for row in csv.reader(io.StringIO(text, newline="")) if len(row) >= 2]
    try:
        numbers = np.array([(float(row[0]), float(row[1])) for row in rows[_header(rows) :]])
    except ValueError as error:
        raise ValueError(f"{path}: {error}; needs rows of time in s, acceleration") from None
    if numbers.shape[0] < 100:
        raise ValueError(f"{path}: {numbers.shape[0]} rows, needs time in s and acceleration")
    time_s, value = numbers.T
    steps = np.diff(time_s)
    if not np.isfinite(numbers).all() or float(steps.min()) <= 0.0:
        raise ValueError(f"{path}: time does not rise or a value is no number")
    rate_hz = 1.0 / float(np.median(steps))
    even = np.arange(time_s[0], time_s[-1], 1.0 / rate_hz)
    return np.asarray(np.interp(even, time_s, value)), rate_hz


def simulated_speaker(played: _Floats) -> _Floats:
    """Move as a small driver does, (N,): resonant at 55 Hz, weak below, with a peak at 400 Hz."""
    hertz = np.arange(played.size // 2 + 1) * (RATE_HZ / played.size)
    resonance = (1j * hertz / 55.0) ** 2 / (1.0 - (hertz / 55.0) ** 2 + 1j * hertz / 55.0 / 1.2)
    bump = 1.0 + 1.0 / (1.0 + 1j * 3.0 * (hertz / 400.0 - 400.0 / np.maximum(hertz, 1e-9)))
    at_reference = np.interp(REFERENCE_HZ, hertz, np.abs(resonance * bump))
    moved = np.fft.rfft(played) * resonance * bump / at_reference
    return np.asarray(np.fft.irfft(moved, played.size))


def _header(rows: list[list[str]]) -> int:
    """Return how many first rows are names: none or one."""
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        return 1
    return 0


def _checked(recorded: _Floats, rate_hz: float) -> _Floats:
    if rate_hz < LEAST_RATE_HZ:
        raise ValueError(f"recorded at {rate_hz:.0f} Hz; needs {LEAST_RATE_HZ:.0f} or more")
    if not SWEEP_S <= recorded.size / rate_hz <= LONGEST_S:
        seconds = recorded.size / rate_hz
        raise ValueError(
            f"lasts {seconds:.3g} s; needs the whole sweep, {SWEEP_S:g} s, and under "
            f"{LONGEST_S:g} s"
        )
    if not np.isfinite(recorded).all():
        raise ValueError("holds values that are no numbers")
    wave = recorded - recorded.mean()
    peak = float(np.abs(wave).max())
    if peak == 0.0:
        raise ValueError("is silent; was the speaker on?")
    return resampled(wave / peak, round(rate_hz))


def _gated(impulse: _Floats) -> _Floats:
    """Return what lies around the peak. Raises ValueError where nothing stands out."""
    peak = int(np.argmax(np.abs(impulse)))
    rolled = np.roll(impulse, impulse.size // 2 - peak)
    away_s = np.abs(np.arange(impulse.size) - impulse.size // 2) / RATE_HZ
    gate = np.clip((GATE_S - away_s) / (0.5 * GATE_S), 0.0, 1.0)
    inside = rolled[away_s < GATE_S]
    outside = rolled[away_s >= GATE_S]
    contrast = np.mean(inside**2) / max(float(np.mean(outside**2)), 1e-30)
    if 10.0 * math.log10(float(contrast)) < LEAST_CONTRAST_DB:
        raise ValueError("does not hold the sweep, or too much noise; play it louder, record again")
    return np.asarray(rolled * gate)
