"""Converts the drive of a palm speaker to the amplitude that a controller plays, 0..1. Pure.

The motor of a controller is not a palm speaker. Its amplitude 1 is weaker, an amplitude below about
0.05 is hardly felt by the hand that holds it, and most motors vibrate at one frequency near
CARRIER_HZ. So the conversion has two steps.

1. `loudness` weighs each frequency of the palm's waveform by what a palm feels of it, relative to
   CARRIER_HZ. A strong vibration that is hardly felt, such as that of glass rubbed fast, then stays
   weak on a motor with one frequency. An actuator that plays the frequency itself needs the drive
   without this step, because there the skin does the weighing.
2. `controller_amplitude` applies a power law. Patterns of the palm span 45 dB, while a controller
   has some 20 dB between just felt and strongest. The power law lifts the weak ones and keeps the
   order of all.

All figures are our choice (docs/physics.md 4.6); they are not tested on people yet.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import drive_threshold_db

Form = Literal["amplitude", "parametric"]
CARRIER_HZ = 160.0  # most controllers vibrate near it
MIN_LEVEL = 1e-3  # -60 dB of the palm speaker's full scale counts as silence
MIN_IMPACT = 0.1  # at gain 1: no tap is weaker, of whatever material
EXPONENT = 0.5
# The strongest slide of the shipped materials at 1 m/s, as loudness and as drive, becomes 0.6.
SCALE: dict[Form, float] = {"amplitude": 2.2, "parametric": 1.4}

_Values = NDArray[np.float64]


def loudness(wave: NDArray[np.float32], rate_hz: float) -> NDArray[np.float32]:
    """Convert the palm's drive (N,) to the drive at CARRIER_HZ that feels as strong, (N,).

    The padded wave is weighed by a zero-phase filter, which smears it by less than 4 ms.
    """
    size = 1 << int(2 * wave.size - 1).bit_length()
    weights = _weights(size, rate_hz)
    weighed = np.fft.irfft(np.fft.rfft(wave, size) * weights, size)[: wave.size]
    return np.asarray(weighed, dtype=np.float32)


def controller_amplitude(level: _Values, form: Form) -> _Values:
    """Return the amplitude (N,), 0..1, that a controller plays for a level (N,).

    A level is sqrt(2) times the rms: of `loudness` for the form `amplitude`, of the drive itself
    for `parametric`.
    """
    scaled = np.minimum(SCALE[form] * np.maximum(level, 0.0) ** EXPONENT, 1.0)
    return np.where(level < MIN_LEVEL, 0.0, scaled)


@lru_cache(maxsize=8)
def _weights(size: int, rate_hz: float) -> _Values:
    hertz = np.fft.rfftfreq(size, 1.0 / rate_hz).astype(np.float64)
    felt_db = drive_threshold_db(np.array([CARRIER_HZ])) - drive_threshold_db(hertz)
    return np.asarray(10.0 ** (felt_db / 20.0))
