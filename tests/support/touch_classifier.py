"""A classifier of touches that knows nothing of how they are synthesised."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from hapticvlm.materials import MATERIALS, Material
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.rendering.vibration.vibration import (
    IMPACTS,
    INTERACTIONS,
    RATE_HZ,
    TEXTURES,
    Motion,
    motion_at,
)
from hapticvlm.rendering.vibration.voices import Command, Voices

EACH = 8  # touches of a material by an interaction: half teach, half are named, and the reverse
SECONDS = 0.8
WINDOWS_S = ((0.0, 0.1), (0.1, 0.3), (0.3, 0.8))
BANDS = 24
PALM_HZ = (20.0, 1100.0)
EAR_HZ = (300.0, 4400.0)
SMALL_SPEAKER_HZ = 350.0
SHRINK = 0.3  # of the covariance towards a sphere
NOISE = {"palm": 3e-5, "ear": 1e-3}

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Recognised:
    """How many touches were named right."""

    right: int
    of: int

    @property
    def share(self) -> float:
        return self.right / self.of


def recognised(seed: int = 5) -> tuple[Recognised, Recognised, Recognised]:
    """By the true voice, by the sound voice behind a small speaker, by the true voice behind it."""
    rng = np.random.default_rng(seed)
    high_pass = signal.butter(4, SMALL_SPEAKER_HZ, "high", fs=RATE_HZ, output="sos")
    right = np.zeros(3, int)
    count = 0
    for interaction in INTERACTIONS:
        features: list[list[_Floats]] = [[], [], []]
        for material in MATERIALS.values():
            for _ in range(EACH):
                wave = _touch(material, interaction, rng)
                noise = rng.standard_normal(wave.size)
                small = signal.sosfilt(high_pass, as_sound(wave))
                features[0].append(_features(wave + NOISE["palm"] * noise, PALM_HZ))
                features[1].append(_features(small + NOISE["ear"] * noise, EAR_HZ))
                lost = signal.sosfilt(high_pass, wave)
                features[2].append(_features(lost + NOISE["ear"] * noise, EAR_HZ))
        of = np.repeat(np.arange(len(MATERIALS)), EACH)
        first = np.arange(of.size) % EACH < EACH // 2
        for voice, each in enumerate(features):
            values = np.array(each)
            for taught in (first, ~first):
                named = _named(values[taught], of[taught], values[~taught])
                right[voice] += int((named == of[~taught]).sum())
        count += of.size
    true, heard, lost_ = (Recognised(int(each), count) for each in right)
    return true, heard, lost_


def _touch(material: Material, kind: str, rng: np.random.Generator) -> NDArray[np.float32]:
    """A touch of this kind with a speed, a force and a seed of its own."""
    speed = rng.uniform(0.15, 0.6) * (10.0 if kind == "swing" else 1.0)
    force = rng.uniform(0.5, 3.0) * (3.0 if kind == "press" else 1.0)
    seed, step = int(rng.integers(1_000_000)), 480
    voices = Voices(table={material.name: material}, fills_caches=False)

    def command(motion: Motion, *, onset: bool = False) -> Command:
        return Command(1, material.name, kind, onset, motion, seed, math.inf)

    if kind in IMPACTS:
        voices.apply(command(Motion(speed, force), onset=True))
    blocks = []
    for begin in range(0, round(SECONDS * RATE_HZ), step):
        now = begin / RATE_HZ
        if kind in TEXTURES:
            voices.apply(command(motion_at(kind, Motion(speed, force), now)))
        elif kind == "press":
            voices.apply(command(Motion(0.0, force * min(now / 0.4, 1.0))))
        blocks.append(voices.render(step, now))
    return np.concatenate(blocks)


def _features(wave: _Floats, within_hz: tuple[float, float]) -> _Floats:
    """Levels in dB of BANDS bands in each window, re the loudest."""
    edges = np.geomspace(*within_hz, BANDS + 1)
    rows = []
    for begin_s, end_s in WINDOWS_S:
        part = wave[round(begin_s * RATE_HZ) : round(end_s * RATE_HZ)]
        power = np.abs(np.fft.rfft(part * np.hanning(part.size), RATE_HZ)) ** 2
        hertz = np.arange(power.size)
        each = pairwise(edges)
        rows.append([power[(hertz >= low) & (hertz < high)].sum() for low, high in each])
    energies = np.array(rows)
    return np.asarray(10.0 * np.log10(energies / energies.max() + 1e-5)).ravel()


def _named(taught: _Floats, of: NDArray[np.intp], asked: _Floats) -> NDArray[np.intp]:
    """Name touches by linear discriminants with a shrunk covariance."""
    classes = np.unique(of)
    means = np.array([taught[of == each].mean(axis=0) for each in classes])
    centred = taught - means[of]
    spread = centred.T @ centred / taught.shape[0]
    spread += np.eye(spread.shape[0]) * SHRINK * np.trace(spread) / spread.shape[0]
    weights = np.linalg.solve(spread, means.T)
    scores = asked @ weights - 0.5 * (means.T * weights).sum(axis=0)
    return np.asarray(classes[scores.argmax(axis=1)])
