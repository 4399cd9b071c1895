"""The vibration half of a touch: the product's own voices, rendered; their spectrum; a WAV file.

Without an interaction the hand strikes, then rubs from RUB_AT_S on, as a scene's `contact` and
`slide` would have it. Rubbing, carving and swinging go to and fro
(rendering/vibration/vibration.py).
"""

from __future__ import annotations

import math
import wave
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from hapticvlm.materials import Material
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.textures import STROUHAL, rendered_hz
from hapticvlm.rendering.vibration.vibration import (
    IMPACTS,
    RATE_HZ,
    SWEEP_S,
    TEXTURES,
    Motion,
    motion_at,
)
from hapticvlm.rendering.vibration.voices import FADE_S, Command, Voices

RUB_AT_S = 0.4
PRESS_S = 0.4  # of a press from nothing to its whole force; our choice
BLOCK = 256
BAND_HZ = (1.0, 1000.0)
THIRDS = tuple(1000.0 * 2.0 ** (third / 3.0) for third in range(-23, 4))  # 5 Hz to 2 kHz
_QUIET_DB = -160.0  # of a band that holds nothing


@dataclass(frozen=True, slots=True)
class Sound:
    """A touch as (N,) float32 in [-1, 1] at RATE_HZ, and how it was made."""

    material: Material
    interaction: str | None
    motion: Motion
    wave: NDArray[np.float32]
    thickness_m: float | None = None

    def describe(self) -> dict[str, Any]:
        """Parameters and spectrum as a map for JSON."""
        facts = self.material.vibration
        levels_db, inside = spectrum(self.wave)
        return {
            "interaction": self.interaction or "strike, then slide",
            "speed_mps": self.motion.speed_mps,
            "force_n": self.motion.force_n,
            "rate_hz": RATE_HZ,
            "seconds": self.wave.size / RATE_HZ,
            "modes": [asdict(mode) for mode in facts.modes],
            "pitch_m": facts.pitch_m,
            "bandwidth": facts.bandwidth,
            "roughness": facts.roughness,
            "stick": facts.stick,
            "swung_m": self._swung_m,
            "sweep_s": SWEEP_S.get(self.interaction or "slide"),
            "texture_hz": rendered_hz(self.motion.speed_mps / self._period_m),
            "peak": float(np.abs(self.wave).max()),
            "rms": float(np.sqrt(np.mean(np.square(self.wave, dtype=np.float64)))),
            "share_1_to_1000_hz": inside,
            "spectrum": {
                "frequency_hz": [round(centre, 2) for centre in THIRDS],
                "level_db": [round(level, 1) for level in levels_db],
                "unit": "dB re full-scale sine, third octaves, mean over the touch",
            },
        }

    @property
    def _swung_m(self) -> float:
        return self.material.vibration.swung_m if self.thickness_m is None else self.thickness_m

    @property
    def _period_m(self) -> float:
        """Way of the hand in one period of the texture."""
        is_swung = self.interaction == "swing"
        return self._swung_m / STROUHAL if is_swung else self.material.vibration.pitch_m


def sound(
    material: Material,
    interaction: str | None,
    motion: Motion,
    seconds: float,
    voices: Voices | None = None,
    thickness_m: float | None = None,
) -> Sound:
    """Render one touch of the right hand, by fresh voices that know the material (synthesised).

    `motion` is the fastest of its strokes, `thickness_m` that of what is swung. It ends at zero.
    """
    if voices is None:
        voices = Voices(table={material.name: material})
    count = max(round(seconds * RATE_HZ), 1)
    begins_s = RUB_AT_S if interaction is None else 0.0
    texture = interaction or "slide"
    command = _command(material.name, texture, motion, thickness_m)
    blocks = []
    if texture in IMPACTS or interaction is None:
        voices.apply(replace(command, interaction=interaction or "strike", onset=True))
    for begin in range(0, count, BLOCK):
        now = begin / RATE_HZ
        if texture in TEXTURES and now >= begins_s:
            voices.apply(replace(command, motion=motion_at(texture, motion, now - begins_s)))
        elif texture == "press":  # the blow is that of the whole force, which then builds up
            force_n = motion.force_n * min(now / PRESS_S, 1.0)
            voices.apply(replace(command, motion=Motion(0.0, force_n)))
        blocks.append(voices.render(min(BLOCK, count - begin), now))
    return Sound(material, interaction, motion, _ended(np.concatenate(blocks)), thickness_m)


def _ended(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fade the end of (N,) as voices fade, down to zero."""
    count = min(round(FADE_S * RATE_HZ), samples.size)
    samples[samples.size - count :] *= np.linspace(1.0, 0.0, count, dtype=np.float32)
    return samples


def spectrum(wave_: NDArray[np.float32]) -> tuple[list[float], float]:
    """Levels of THIRDS in dB re a full-scale sine, and the share of power within BAND_HZ."""
    power = np.abs(np.fft.rfft(wave_.astype(np.float64))) ** 2
    power *= 4.0 / wave_.size**2
    hertz = np.arange(power.size) * (RATE_HZ / wave_.size)
    edge = 2.0 ** (1.0 / 6.0)
    bands = [power[(hertz >= at / edge) & (hertz < at * edge)].sum() for at in THIRDS]
    total = float(power.sum())
    inside = float(power[(hertz >= BAND_HZ[0]) & (hertz <= BAND_HZ[1])].sum())
    levels = [10.0 * math.log10(band) if band > 1e-16 else _QUIET_DB for band in bands]
    return levels, inside / total if total > 0.0 else 1.0


def threshold_shape_db() -> list[float]:
    """Drive that is just felt at each of THIRDS, dB re that at 250 Hz."""
    return [float(level) for level in drive_threshold_db(np.array(THIRDS))]


def write_wav(path: Path, samples: NDArray[np.float32]) -> None:
    """Write (N,) float32 as 16-bit mono at RATE_HZ. Raises OSError."""
    with path.open("wb") as raw, wave.open(raw, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE_HZ)
        file.writeframes((np.clip(samples, -1.0, 1.0) * 32767.0).astype("<i2").tobytes())


def _command(material: str, interaction: str, motion: Motion, thickness_m: float | None) -> Command:
    return Command(
        hand=1,
        material=material,
        interaction=interaction,
        onset=False,
        motion=motion,
        seed=1,
        expires_at=math.inf,
        thickness_m=thickness_m if interaction == "swing" else None,
    )
