"""The methods to render vibration, compared: modes of an impact, orders of noise, block sizes.

Errors are the largest perceived difference, dB (spectra.felt_difference_db), over materials and
strokes; costs are the least of ROUNDS on this process's core, which other work disturbs least.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, signal

from hapticvlm.materials import MATERIALS, Mode, Vibration
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm_lab.bench.rigs import core_us
from hapticvlm_lab.bench.vibration.spectra import difference_db, event_db, steady_db

Wave = NDArray[np.float32]

NAMES = ("wood", "glass", "fabric", "metal")
# A struck body has more modes than a table holds. Those it might have beyond are put on in the
# ratios of the glass preset (docs/physics.md 4.3), then as that row goes on. One loss factor
# makes decays rise with frequency (physics.md 4.3), an equal push makes amplitudes fall with it.
RATIOS = (1.0, 1.857, 3.25, 4.946, 6.7, 8.6)
MODES = (1, 2, 3, 4, 6)
SHIPPED = "as shipped"
HIT_MPS = (0.3, 1.0, 5.0)
ORDERS = (2, 4, 8, 16, 32, 64)
AR_RATE_HZ = 4_000  # twice the band; what is made there is read up to RATE_HZ
RUBBED = Motion(0.15, 0.0)  # no force: nothing sticks, the noise alone is compared
STEADY_S = 12.0
BLOCKS = (16, 32, 64, 128, 256, 512, 1024)
UPDATES_HZ = 75.0
ROUNDS = 15


@dataclass(frozen=True, slots=True)
class Row:
    """A method: error in dB, where, and us a strike or a block of 128; `delay_ms` of a block."""

    knob: str
    value: str
    is_default: bool
    error_db: float
    error_at: str
    cost_us: float
    delay_ms: float | None = None
    core_share: float | None = None


def modes() -> list[Row]:
    """Cut every material's row of modes short after n of them, and where the table ends it."""
    rows = {name: _whole_row(material.vibration) for name, material in MATERIALS.items()}
    shipped = {name: len(material.vibration.modes) for name, material in MATERIALS.items()}
    tables = {str(count): dict.fromkeys(rows, count) for count in MODES} | {SHIPPED: shipped}
    costs: dict[tuple[str, int], float] = {}
    found = []
    for value, counts in tables.items():
        errors: dict[str, float] = {}
        cost_us = []
        for name, full in rows.items():
            cut = replace(full, modes=full.modes[: counts[name]])
            errors |= {f"{name} at {hit:g} m/s": _cut_db(full, cut, hit) for hit in HIT_MPS}
            key = name, len(cut.modes)
            if key not in costs:
                costs[key] = _least_us(lambda v=cut: impact(v, "strike", Motion(1.0, 1.0), 0))  # type: ignore[misc]
            cost_us.append(costs[key])
        found.append(_row("modes", value, errors, float(np.mean(cost_us))))
    return found


def noises() -> list[Row]:
    """Rub each surface by the product's loop and by autoregressive filters of rising order."""
    meant = {name: steady_db(_rub(name, seed=1)) for name in NAMES}
    loop = {name: difference_db(meant[name], steady_db(_rub(name, seed=2))) for name in NAMES}
    texture = Texture(MATERIALS["wood"].vibration, "slide", 1)
    texture.render(9600, RUBBED)
    cost_us = _least_us(lambda: texture.render(128, RUBBED))
    rows = [_row("noise", "loop in space", loop, cost_us)]
    for order in ORDERS:
        filters = {name: _fit(_rub(name, seed=1), order) for name in NAMES}
        errors = {
            name: difference_db(meant[name], steady_db(_filtered(*filters[name], STEADY_S)))
            for name in NAMES
        }
        taps, gain = filters["wood"]
        cost_us = _least_us(lambda t=taps, g=gain: _filtered(t, g, 128 / RATE_HZ))  # type: ignore[misc]
        rows.append(_row("noise", f"AR {order}", errors, cost_us))
    return rows


def blocks() -> list[Row]:
    """Render two rubbing hands in blocks; each contact waits for the next block."""
    meant = steady_db(_moving(1))
    rows = []
    for size in BLOCKS:
        errors = {"two hands, 75 contacts a second": difference_db(meant, steady_db(_moving(size)))}
        voices = _two_hands()
        cost_us = _least_us(lambda v=voices, n=size: v.render(n, 0.0))  # type: ignore[misc]
        row = _row("block", str(size), errors, cost_us)
        seconds = size / RATE_HZ
        rows.append(replace(row, delay_ms=1e3 * seconds, core_share=cost_us * 1e-6 / seconds))
    return rows


DEFAULTS = {"modes": SHIPPED, "noise": "loop in space", "block": "128"}


def _row(knob: str, value: str, errors: dict[str, float], cost_us: float) -> Row:
    at = max(errors, key=errors.__getitem__)
    is_default = DEFAULTS[knob] == value
    return Row(knob, value, is_default, round(errors[at], 2), at, round(cost_us, 1))


def _whole_row(vibration: Vibration) -> Vibration:
    """Go on where the table ends, up to as many modes as RATIOS has within the band."""
    first = vibration.modes[0]
    known = len(vibration.modes)
    beyond = tuple(
        Mode(first.frequency_hz * ratio, first.decay_per_s * ratio, first.gain / ratio)
        for ratio in RATIOS[known:]
        if first.frequency_hz * ratio <= 1000.0
    )
    return replace(vibration, modes=vibration.modes + beyond)


def _cut_db(full: Vibration, cut: Vibration, speed_mps: float) -> float:
    motion = Motion(speed_mps, 1.0)
    meant, given = (event_db(impact(v, "strike", motion, 0)) for v in (full, cut))
    return difference_db(meant, given)


def _rub(name: str, seed: int) -> Wave:
    texture = Texture(MATERIALS[name].vibration, "slide", seed)
    texture.render(9600, RUBBED)
    return texture.render(int(STEADY_S * RATE_HZ), RUBBED)


def _fit(wave: Wave, order: int) -> tuple[NDArray[np.float64], float]:
    """Fit an AR model at AR_RATE_HZ by Yule and Walker: its taps (order + 1,) and gain."""
    few = signal.decimate(signal.decimate(wave.astype(np.float64), 4), 3)
    lags = np.array([np.dot(few[: few.size - n], few[n:]) / few.size for n in range(order + 1)])
    lags[0] *= 1.0 + 1e-6
    taps = linalg.solve_toeplitz(lags[:order], lags[1:])
    return np.concatenate(([1.0], -taps)), float(np.sqrt(max(lags[0] - taps @ lags[1:], 0.0)))


def _filtered(taps: NDArray[np.float64], gain: float, seconds: float) -> Wave:
    count = int(seconds * AR_RATE_HZ) + 2
    few = signal.lfilter([gain], taps, np.random.default_rng(5).standard_normal(count))
    at = np.arange(int(seconds * RATE_HZ)) * (AR_RATE_HZ / RATE_HZ)
    return np.asarray(np.interp(at, np.arange(count), few), dtype=np.float32)


def _two_hands() -> Voices:
    voices = Voices()
    for hand, name in enumerate(("wood", "rubber")):
        voices.apply(Command(hand, name, "slide", False, Motion(0.2, 2.0), hand, np.inf))
    for _ in range(40):
        voices.render(256, 0.0)
    return voices


def _moving(size: int) -> Wave:
    """Two hands whose contacts come between blocks of `size`; 1 stands for 8 samples."""
    voices = _two_hands()
    step = max(size, 8)
    every = RATE_HZ / UPDATES_HZ
    updates = 0
    waves = []
    for begin in range(0, 4 * RATE_HZ, step):
        while updates * every < begin:
            speed_mps = 0.2 + 0.1 * np.sin(2.0 * np.pi * updates / UPDATES_HZ)
            for hand, name in enumerate(("wood", "rubber")):
                motion = Motion(float(speed_mps), 2.0)
                voices.apply(Command(hand, name, "slide", False, motion, hand, np.inf))
            updates += 1
        waves.append(voices.render(step, 0.0))
    return np.concatenate(waves)


def _least_us(work: Callable[[], object]) -> float:
    work()
    return min(core_us(work, 20) for _ in range(ROUNDS))
