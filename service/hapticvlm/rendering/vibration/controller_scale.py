"""From what a palm speaker does to what a controller is told to play, 0..1. Pure.

A controller's motor is no palm speaker: its 1 is weaker, what it is told below some 0.05 is hardly
felt by a hand that holds it, and most vibrate at one frequency near CARRIER_HZ. So two steps lie
between them.

1. `loudness`: each frequency of the palm's waveform counts as much as a palm feels of it, relative
   to CARRIER_HZ. What is strong and hardly felt, as glass rubbed fast, then stays weak on a motor
   of one frequency. An actuator that plays the frequency too needs the drive itself: there the skin
   does the weighing.
2. `controller_amplitude`: a power law lifts the weak without turning their order round. Patterns of
   the palm span 45 dB, a controller has some 20 dB between just felt and its strongest.

The figures stand in docs/physics.md 4.6, all our choice: nobody has felt them on a controller yet.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import drive_threshold_db

Form = Literal["amplitude", "parametric"]
CARRIER_HZ = 160.0  # what most controllers vibrate at
MIN_LEVEL = 1e-3  # -60 dB of the palm speaker's full scale counts as silence
MIN_IMPACT = 0.1  # at gain 1: no tap is weaker, of whatever material
EXPONENT = 0.5
# The strongest slide of the shipped materials at 1 m/s, as loudness and as drive, becomes 0.6.
_SCALE: dict[Form, float] = {"amplitude": 2.2, "parametric": 1.4}

_Values = NDArray[np.float64]


def loudness(wave: NDArray[np.float32], rate_hz: float) -> NDArray[np.float32]:
    """Weigh the palm's drive (N,) by what is felt of each frequency; (N,), as drive at CARRIER_HZ.

    By a Fourier transform of the padded piece, without phase: what it smears is shorter than 4 ms.
    """
    size = 1 << int(2 * wave.size - 1).bit_length()
    weights = _weights(size, rate_hz)
    weighed = np.fft.irfft(np.fft.rfft(wave, size) * weights, size)[: wave.size]
    return np.asarray(weighed, dtype=np.float32)


def controller_amplitude(level: _Values, form: Form) -> _Values:
    """Return what a controller plays (N,), 0..1, for a level (N,), sqrt(2) times the rms.

    `level` is that of `loudness` for the form `amplitude`, of the drive itself for `parametric`.
    """
    scaled = np.minimum(_SCALE[form] * np.maximum(level, 0.0) ** EXPONENT, 1.0)
    return np.where(level < MIN_LEVEL, 0.0, scaled)


@lru_cache(maxsize=8)
def _weights(size: int, rate_hz: float) -> _Values:
    hertz = np.fft.rfftfreq(size, 1.0 / rate_hz).astype(np.float64)
    felt_db = drive_threshold_db(np.array([CARRIER_HZ])) - drive_threshold_db(hertz)
    return np.asarray(10.0 ** (felt_db / 20.0))
