"""Measures how well a palm could tell the built-in materials apart by vibration alone.

A simulated palm receives touches of each material, with the same stroke, and a statistical observer
names the material. The observer knows nothing of the synthesis: neither modes nor pitches, only the
waveform that leaves the voices. Its steps are those of an ideal observer with a noisy skin.

1. Threshold. A palm feels nothing below its threshold, so noise that is just felt is added to the
   waveform: in each third octave it has the power of a tone there that is just felt
   (`perception.drive_threshold_db`, FULL_SCALE_DB). A vibration below the threshold disappears in
   it, since the noise differs from touch to touch and says nothing of the material.
2. Features. The levels in dB of third octaves from 20 to 640 Hz in windows of time.
3. Resolution. Each level gets normal noise of NOISE_DB, since skin does not measure to a tenth of a
   dB. Without it any two waveforms could be told apart.
4. Answer. Linear discriminants with a shrunk covariance, taught by touches of other seeds than
   those that it names (one seed is left out at a time).

Two figures come out: the share of touches that are named right, and for each two materials the
sensitivity d': the distance between the means of the two along the best direction, in standard
deviations along it. Of touches of two materials at a d' of 1, 31 in 100 are mistaken, at 2 16, at 4
two. The simulated palm is not a person; nobody has judged these vibrations.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS, Material
from hapticvlm.perception import FULL_SCALE_DB, drive_threshold_db
from hapticvlm.rendering.vibration.equaliser import Playback
from hapticvlm.rendering.vibration.vibration import IMPACTS, Motion, motion_at
from hapticvlm.rendering.vibration.voices import Command, Voices

RATE_HZ = 4000  # the voices hold nothing above 1 kHz
STEP = 80  # samples between two touches of a scene, 20 ms
EIGHT = ("wood", "glass", "fabric", "metal", "plastic", "stone", "leather", "rubber")
SEEDS = 10
REPEATS = 10  # of each waveform, each with noise of its own
# A difference of 1.6 dB is just noticed at the thenar if nothing else differs (physics.md 4.2). Up
# to 48 levels are compared by an ideal observer here, so each is noisier. The value is our choice:
# with it this observer named as many touches right as another one, made independently of it (33,
# 69, 80 and 66 % of strikes of 0.1 and 0.5 m/s, slides and carves of commit 3cb57bbf; this one 30,
# 69, 80 and 65).
NOISE_DB = 6.0
SHRINK = 0.1  # of the covariance towards a sphere
BANDS_HZ = 20.0 * 2.0 ** (np.arange(16) / 3.0)
_EDGE = 2.0 ** (1.0 / 6.0)
_NOISE_HZ = (20.0, 700.0)
_WINDOWS_S = {True: ((0.0, 0.05), (0.05, 0.15), (0.15, 0.4)), False: ((0.1, 0.5), (0.5, 1.2))}

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stroke:
    """One way of touching: the interaction, and the speed and force at which it is done."""

    interaction: str
    motion: Motion

    @property
    def name(self) -> str:
        """Return the name of its row."""
        return f"{self.interaction} {self.motion.speed_mps:g} m/s"

    @property
    def is_impact(self) -> bool:
        """Whether it is over at once."""
        return self.interaction in IMPACTS


STROKES = (
    Stroke("strike", Motion(0.1, 1.0)),
    Stroke("strike", Motion(0.5, 2.0)),
    Stroke("tap", Motion(0.3, 1.0)),
    Stroke("slide", Motion(0.1, 1.0)),
    Stroke("slide", Motion(0.3, 1.0)),
    Stroke("carve", Motion(0.15, 4.0)),
)
BOTH = (STROKES[1], STROKES[4])  # of which the printed table of d' is


@dataclass(frozen=True, slots=True)
class Told:
    """How well materials are told apart by one stroke.

    `confusion` is the share of touches of each material (rows) that were named as each (columns),
    (M, M); `sensitivity` is the d' of each two materials, (M, M).
    """

    stroke: Stroke
    names: tuple[str, ...]
    confusion: Floats
    sensitivity: Floats

    @property
    def right(self) -> float:
        """Share of touches that were named right."""
        return float(np.trace(self.confusion) / len(self.names))

    def alike(self, count: int = 3) -> list[tuple[str, str, float]]:
        """Return the pairs with the least d', and it."""
        pairs = [
            (self.names[one], self.names[other], float(self.sensitivity[one, other]))
            for one, other in combinations(range(len(self.names)), 2)
        ]
        return sorted(pairs, key=lambda pair: pair[2])[:count]


def told(
    stroke: Stroke,
    names: Sequence[str] = tuple(MATERIALS),
    *,
    table: Mapping[str, Material] = MATERIALS,
    has_threshold: bool = True,
    seeds: int = SEEDS,
) -> Told:
    """Return how well these materials of `table` are told apart by one stroke."""
    rng = np.random.default_rng(7)
    values = np.array(
        [
            [
                [
                    _features(wave + has_threshold * skin_noise(wave.size, rng), stroke, rng)
                    for _ in range(REPEATS)
                ]
                for wave in (touched(table[name], stroke, seed) for seed in range(1, seeds + 1))
            ]
            for name in names
        ]
    )  # (materials, seeds, repeats, features)
    confusion = np.zeros((len(names), len(names)))
    gaps = np.zeros((len(names), len(names)))
    for left_out in range(seeds):
        taught = np.delete(values, left_out, axis=1).reshape(len(names), -1, values.shape[-1])
        asked = values[:, left_out]
        confusion += _confusion(taught, asked)
        gaps += _sensitivity(taught, asked)
    return Told(stroke, tuple(names), confusion / seeds, gaps / seeds)


def touched(material: Material, stroke: Stroke, seed: int) -> Floats:
    """Return the waveform of one touch at RATE_HZ, (N,), as long as its last window."""
    voices = Voices(table={material.name: material}, playback=Playback(RATE_HZ), fills_caches=False)
    blocks = []
    end_s = _WINDOWS_S[stroke.is_impact][-1][1]
    for begin in range(0, round(end_s * RATE_HZ), STEP):
        now = begin / RATE_HZ
        if not stroke.is_impact or not begin:
            motion = motion_at(stroke.interaction, stroke.motion, now)
            voices.apply(
                Command(
                    1, material.name, stroke.interaction, stroke.is_impact, motion, seed, math.inf
                )
            )
        blocks.append(voices.render(STEP, now))
    return np.concatenate(blocks).astype(np.float64)


def skin_noise(count: int, rng: np.random.Generator) -> Floats:
    """Return noise (count,) that is just felt, as the head of the file explains."""
    hertz = np.fft.rfftfreq(count, 1.0 / RATE_HZ)
    inside = (hertz > _NOISE_HZ[0]) & (hertz < _NOISE_HZ[1])
    # A third octave around f is f (edge - 1 / edge) wide. Its noise has the power of a tone that is
    # just felt, 1/2 of its squared amplitude, spread over the lines of the spectrum in it. A line
    # of magnitude m adds the power 2 (m / count)^2.
    threshold_db = drive_threshold_db(np.maximum(hertz, 1.0)) - FULL_SCALE_DB
    lines = np.maximum(hertz, 1.0) * (_EDGE - 1.0 / _EDGE) * count / RATE_HZ
    magnitudes = 0.5 * count * 10.0 ** (threshold_db / 20.0) / np.sqrt(lines)
    spectrum = np.where(inside, magnitudes, 0.0) * np.exp(2j * math.pi * rng.random(hertz.size))
    return np.asarray(np.fft.irfft(spectrum, count))


def _features(wave: Floats, stroke: Stroke, rng: np.random.Generator) -> Floats:
    """Return noisy levels of the bands in each window, (windows * bands,), dB."""
    rows = []
    for begin_s, end_s in _WINDOWS_S[stroke.is_impact]:
        part = wave[round(begin_s * RATE_HZ) : round(end_s * RATE_HZ)]
        size = max(part.size, RATE_HZ // 4)
        power = np.abs(np.fft.rfft(part * np.hanning(part.size), size)) ** 2 / part.size
        hertz = np.fft.rfftfreq(size, 1.0 / RATE_HZ)
        rows.append([power[(hertz >= hz / _EDGE) & (hertz < hz * _EDGE)].sum() for hz in BANDS_HZ])
    levels = 10.0 * np.log10(np.array(rows).ravel() + 1e-12)
    return np.asarray(levels + rng.normal(0.0, NOISE_DB, levels.size))


def _discriminant(taught: Floats) -> tuple[Floats, Floats]:
    """Return the means (M, F) and the inverse of the shrunk covariance, (F, F)."""
    means = taught.mean(axis=1)
    centred = (taught - means[:, None]).reshape(-1, taught.shape[-1])
    spread = centred.T @ centred / len(centred)
    size = spread.shape[0]
    spread = (1.0 - SHRINK) * spread + SHRINK * np.trace(spread) / size * np.eye(size)
    return means, np.linalg.inv(spread)


def _confusion(taught: Floats, asked: Floats) -> Floats:
    means, inverse = _discriminant(taught)
    weights = means @ inverse
    scores = asked @ weights.T - 0.5 * (means * weights).sum(axis=1)
    named = scores.argmax(axis=2)  # (materials, repeats)
    return np.array([np.bincount(row, minlength=len(means)) / row.size for row in named])


def _sensitivity(taught: Floats, asked: Floats) -> Floats:
    """Return the d' of each two materials in the seed that was left out, (M, M)."""
    means, inverse = _discriminant(taught)
    count = len(means)
    gaps = np.zeros((count, count))
    for one, other in combinations(range(count), 2):
        axis = inverse @ (means[one] - means[other])
        of_one, of_other = asked[one] @ axis, asked[other] @ axis
        within = (taught[[one, other]] - means[[one, other], None]) @ axis
        gap = (of_one.mean() - of_other.mean()) / max(float(within.std()), 1e-9)
        gaps[one, other] = gaps[other, one] = gap
    return gaps


def run(*, as_json: bool) -> int:
    """Print the shares named right, the pairs that are most alike and the table of d'."""
    rows = [(told(stroke), told(stroke, EIGHT)) for stroke in STROKES]
    names = rows[0][0].names
    # What two strokes say of a pair adds up as independent evidence does: d' as a distance.
    both = np.sqrt(sum(np.square(every.sensitivity) for every, _ in rows if every.stroke in BOTH))
    if as_json:
        print(json.dumps([_figures(*row) for row in rows]))
        return 0
    print("A simulated palm names the material of a touch; nobody has judged these vibrations.")
    print(f"{'stroke':<16} {'of 11':>6} {'of 8':>6}   most alike, with d'")
    for every, eight in rows:
        alike = ", ".join(f"{one}-{other} {gap:.1f}" for one, other, gap in every.alike())
        print(f"{every.stroke.name:<16} {every.right:>6.0%} {eight.right:>6.0%}   {alike}")
    print(f"chance: {1 / len(names):.0%} and {1 / len(EIGHT):.0%}")
    print("\nd' of each two materials, struck at 0.5 m/s and slid over at 0.3 m/s:")
    print(" " * 8, *(f"{name[:6]:>6}" for name in names))
    for name, row in zip(names, both, strict=True):
        print(f"{name:<8}", *(f"{gap:>6.1f}" if gap else f"{'':>6}" for gap in row))
    return 0


def _figures(every: Told, eight: Told) -> dict[str, object]:
    return {
        "stroke": every.stroke.name,
        "materials": every.names,
        "right": round(every.right, 4),
        "right_of_eight": round(eight.right, 4),
        "sensitivity": np.round(every.sensitivity, 2).tolist(),
    }
