"""What a wave of the speaker is measured by, and blocks of the mixer in a row."""

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Voices

Wave = NDArray[np.float32]
BLOCK = 128


def listen(voices: Voices, seconds: float, now: float = 0.0, block: int = BLOCK) -> Wave:
    """Render block by block from `now` on, (N,)."""
    starts = range(0, round(seconds * RATE_HZ), block)
    return np.concatenate([voices.render(block, now + start / RATE_HZ) for start in starts])


def rms(wave: Wave) -> float:
    return float(np.sqrt(np.mean(np.square(wave, dtype=np.float64))))


def above_band_db(wave: Wave) -> float:
    """Share of a wave's energy above 1050 Hz, under a Hann window, dB."""
    power = np.abs(np.fft.rfft(wave * np.hanning(wave.size))) ** 2
    hertz = np.arange(float(power.size)) * (RATE_HZ / wave.size)
    return float(10 * np.log10(power[hertz > 1050].sum() / (power.sum() + 1e-30) + 1e-30))
