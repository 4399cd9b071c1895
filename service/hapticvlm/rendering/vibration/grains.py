"""Renders a press on something soft as a grain of vibration for each step that it yields. Pure.

A hard speaker cannot yield. But a hand that feels a short grain for each bit of force that it adds
believes that the object moved: the denser the grains, the softer it seems (Kildal 2010; Visell and
others 2011; docs/physics.md 4.3). The object yields by force over stiffness, and there is a grain
for every STEP_M of that, so a cushion has many grains per newton and stone has none. Grains come
only while the press deepens. A hand that releases and presses again feels them again.
"""

from __future__ import annotations

import copy
import math

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Vibration
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.smoothing import SmoothedValue
from hapticvlm.rendering.vibration.textures import grain
from hapticvlm.rendering.vibration.vibration import Motion

# All figures are our choice (physics.md 4.3).
STEP_M = 2.5e-4  # by which the object yields from grain to grain
MAX_RATE_HZ = 120.0  # more grains a second would be felt as a tone
STRENGTH = 0.45  # of a fibre break's
BACK = 0.75  # steps by which a hand must release before it feels the same step again


def steps(vibration: Vibration, force_n: float) -> float:
    """Return the number of steps by which this yields under a force, N."""
    return force_n / (vibration.stiffness * STEP_M)


class Grains:
    """Plays the grains of one press; its state makes consecutive blocks join."""

    def __init__(self, vibration: Vibration, seed: int, playback: Playback = NOMINAL) -> None:
        self._vibration = vibration
        self._rate_hz = playback.rate_hz
        self._grain = STRENGTH * grain(vibration, playback)
        self._tail = np.zeros(self._grain.size)
        self._depth = SmoothedValue()
        # The seed sets where the first step lies, and with it how many steps a force passes.
        self._next = 0.3 + 0.4 * np.random.default_rng(seed).random()
        self._rest = 0  # samples before another grain may begin

    def fork(self) -> Grains:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._depth = self._depth.fork()
        return forked

    def render(self, count: int, motion: Motion) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32; the press approaches the motion's force."""
        wave = np.concatenate((self._tail, np.zeros(count)))
        depth = self._depth.follow(steps(self._vibration, motion.force_n), count, self._rate_hz)
        if not isinstance(depth, float):
            self._step_into(wave, depth)
        self._rest = max(self._rest - count, 0)
        self._tail = wave[count:]
        return np.asarray(wave[:count], dtype=np.float32)

    def _step_into(self, wave: NDArray[np.float64], depth: NDArray[np.float64]) -> None:
        """Add the grains of the steps that are passed; drop those too soon after the last one."""
        # `_next` is the depth, in steps, of the next grain, and `depth` the depth at each sample. A
        # grain begins at the first sample that reaches `_next`. If the depth then lies beyond
        # further steps, those are skipped: a grain for each would come faster than MAX_RATE_HZ.
        begin = self._rest
        min_gap = round(self._rate_hz / MAX_RATE_HZ)
        while begin < depth.size:
            passed = np.flatnonzero(depth[begin:] >= self._next)
            if not passed.size:
                break
            at = begin + int(passed[0])
            wave[at : at + self._grain.size] += self._grain
            self._next += math.floor(depth[at] - self._next) + 1.0
            begin = self._rest = at + min_gap
        # When the hand releases, the steps that it has left by more than BACK can be felt again.
        # Without this hysteresis a trembling hand would repeat one grain.
        deepest = self._next - 1.0
        if depth[-1] < deepest - BACK:
            self._next -= math.floor(deepest - depth[-1] - BACK) + 1.0
