"""Renders the vibration half of a touch by the service's own voices, and its spectrum.

Without an interaction the hand strikes and then rubs from RUB_AT_S on, as `contact` and `slide` of
a scene would. Rubbing, carving and swinging go to and fro (rendering/vibration/vibration.py).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from hapticvlm.materials import Material
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.textures import STROUHAL, rendered_hz
from hapticvlm.rendering.vibration.vibration import (
    RATE_HZ,
    SWEEP_S,
    TEXTURES,
    Motion,
    motion_at,
)
from hapticvlm.rendering.vibration.voices import FADE_S, Command, Voices

RUB_AT_S = 0.4
PRESS_S = 0.4  # in which a press builds up its full force; our choice
BLOCK = 256
BAND_HZ = (1.0, 1000.0)
THIRDS = tuple(1000.0 * 2.0 ** (third / 3.0) for third in range(-23, 4))  # 5 Hz to 2 kHz
_QUIET_DB = -160.0  # level of an empty band


@dataclass(frozen=True, slots=True)
class Sound:
    """A touch: `wave` is (N,) float32 in [-1, 1] at RATE_HZ; the rest is how it was rendered."""

    material: Material
    interaction: str | None
    motion: Motion
    wave: NDArray[np.float32]
    thickness_m: float | None = None

    def describe(self) -> dict[str, Any]:
        """Return parameters and spectrum as a map for JSON."""
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
        """Path of the hand in one period of the texture, m."""
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
    """Render one touch of the right hand that lasts `seconds` and ends at zero.

    `motion` holds the highest speed of a stroke and the force, `thickness_m` the thickness of what
    is swung. Without `voices`, new ones synthesise the material.
    """
    if voices is None:
        voices = Voices(table={material.name: material})
    count = max(round(seconds * RATE_HZ), 1)
    begins_s = RUB_AT_S if interaction is None else 0.0
    texture = interaction or "slide"
    onset, command = commands(material.name, interaction, motion, thickness_m)
    blocks = []
    if onset is not None:
        voices.apply(onset)
    for begin in range(0, count, BLOCK):
        now = begin / RATE_HZ
        if now >= begins_s and (moved := _motion_after(texture, motion, now - begins_s)):
            voices.apply(replace(command, motion=moved))
        blocks.append(voices.render(min(BLOCK, count - begin), now))
    return Sound(material, interaction, motion, _ended(np.concatenate(blocks)), thickness_m)


def commands(
    material: str, interaction: str | None, motion: Motion, thickness_m: float | None = None
) -> tuple[Command | None, Command]:
    """Return the command of a contact, None where nothing strikes, and that of the motion."""
    moved = _command(material, interaction or "slide", motion, thickness_m)
    if interaction in TEXTURES:
        return None, moved
    return replace(moved, interaction=interaction or "strike", onset=True), moved


def _motion_after(interaction: str, motion: Motion, now: float) -> Motion | None:
    """Return how the hand moves at this time after it began; None: it has only struck."""
    if interaction == "press":  # the contact sounds at full force; the force then builds up
        return Motion(0.0, motion.force_n * min(now / PRESS_S, 1.0))
    return motion_at(interaction, motion, now) if interaction in TEXTURES else None


def _ended(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return samples (N,) with their end faded to zero, as voices fade."""
    count = min(round(FADE_S * RATE_HZ), samples.size)
    samples[samples.size - count :] *= np.linspace(1.0, 0.0, count, dtype=np.float32)
    return samples


def spectrum(samples: NDArray[np.float32]) -> tuple[list[float], float]:
    """Return the levels of THIRDS in dB re a full-scale sine, and the share of power in BAND_HZ."""
    # |X| of a full-scale sine of N samples is N / 2 in its bin, so 4 |X|^2 / N^2 is 1 there.
    power = np.abs(np.fft.rfft(samples.astype(np.float64))) ** 2
    power *= 4.0 / samples.size**2
    hertz = np.arange(power.size) * (RATE_HZ / samples.size)
    edge = 2.0 ** (1.0 / 6.0)
    bands = [power[(hertz >= at / edge) & (hertz < at * edge)].sum() for at in THIRDS]
    total = float(power.sum())
    inside = float(power[(hertz >= BAND_HZ[0]) & (hertz <= BAND_HZ[1])].sum())
    levels = [10.0 * math.log10(band) if band > 1e-16 else _QUIET_DB for band in bands]
    return levels, inside / total if total > 0.0 else 1.0


def threshold_shape_db() -> list[float]:
    """Return the drive that is just felt at each of THIRDS, dB re that at 250 Hz."""
    return [float(level) for level in drive_threshold_db(np.array(THIRDS))]


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
