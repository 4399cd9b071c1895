"""Plays one sound source, an impact, a texture or a recording, with a fading gain. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.grains import Grains
from hapticvlm.rendering.vibration.hum import Tone
from hapticvlm.rendering.vibration.patterns import PatternTexture
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import Motion


@dataclass(slots=True)
class Voice:
    """One source with its gain, which fades towards `aim`; at 0 the voice has ended.

    `source` renders its own blocks, or it is the waveform (N,) of an impact, played from sample
    `at` on. `key` is its (material, interaction).
    """

    source: Texture | PatternTexture | Grains | Tone | NDArray[np.float32]
    motion: Motion
    key: tuple[str, str]
    gain: float
    aim: float = 1.0
    at: int = 0
    ended: bool = False
    thickness_m: float | None = None

    def fork(self) -> Voice:
        """Return an independent copy in the same state."""
        if isinstance(self.source, Texture | PatternTexture | Grains | Tone):
            return replace(self, source=self.source.fork())
        return replace(self)

    def render(self, count: int, step: float) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32; the gain moves by at most `step` per sample."""
        if isinstance(self.source, Texture | PatternTexture | Grains):
            block = self.source.render(count, self.motion)
        elif isinstance(self.source, Tone):
            block = self.source.render(count)
        else:
            block = np.zeros(count, np.float32)
            part = self.source[self.at : self.at + count]
            block[: part.size] = part
            self.at += count
            self.ended = self.at >= self.source.size
        if self.gain != self.aim:
            gains = ramp(self.gain, self.aim, count, step)
            self.gain = float(gains[-1])
            block = block * gains
        elif self.gain != 1.0:
            block = block * np.float32(self.gain)
        self.ended = self.ended or self.gain == self.aim == 0.0
        return block


def ramp(begin: float, end: float, count: int, step: float) -> NDArray[np.float32]:
    """Gains of the next samples, (count,), moving from `begin` by `step` each until `end`."""
    steps = np.arange(1, count + 1, dtype=np.float32) * np.float32(step)
    gains = np.minimum(begin + steps, end) if end > begin else np.maximum(begin - steps, end)
    return np.asarray(gains, dtype=np.float32)
