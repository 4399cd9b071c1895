"""The methods to render vibration, compared: modes of an impact, orders of noise, block sizes.

Errors are the largest perceived difference, dB (spectra.felt_difference_db), over materials and
strokes; costs are the least of ROUNDS on this process's core, which other work disturbs least, all
methods of a knob in turns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, signal

from hapticvlm.materials import MATERIALS, Mode, Vibration
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm_lab.bench.rigs import K, least_us
from hapticvlm_lab.bench.vibration.spectra import difference_db, event_db, steady_db

Wave = NDArray[np.float32]

NAMES = ("wood", "glass", "fabric", "metal")
# A struck body has more modes than a table holds. Those it might have beyond are put on in the
# ratios of the glass preset (docs/physics.md 4.3), then as that row goes on. One loss factor
# makes decays rise with frequency (physics.md 4.3), an equal push makes amplitudes fall with it.
RATIOS = (1.0, 1.857, 3.25, 4.946, 6.7, 8.6)
MODES = (1, 2, 3, 4, 6)
SHIPPED = "as shipped"
LOOP = "loop in space"
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
    counted = {str(count): dict.fromkeys(rows, count) for count in MODES} | {SHIPPED: shipped}
    tables = {
        value: {
            name: replace(full, modes=full.modes[: counts[name]]) for name, full in rows.items()
        }
        for value, counts in counted.items()
    }
    cuts = {(name, len(cut.modes)): cut for table in tables.values() for name, cut in table.items()}
    costs = _least_us({key: partial(_strike, cut) for key, cut in cuts.items()})
    found = []
    for value, table in tables.items():
        errors = {
            f"{name} at {hit:g} m/s": _cut_db(rows[name], cut, hit)
            for name, cut in table.items()
            for hit in HIT_MPS
        }
        cost_us = [costs[name, len(cut.modes)] for name, cut in table.items()]
        found.append(_row("modes", value, errors, float(np.mean(cost_us))))
    return found


def noises() -> list[Row]:
    """Rub each surface by the product's loop and by autoregressive filters of rising order."""
    meant = {name: steady_db(rub(name, seed=1)) for name in NAMES}
    loop = {name: difference_db(meant[name], steady_db(rub(name, seed=2))) for name in NAMES}
    filters = {order: {name: fit(rub(name, seed=1), order) for name in NAMES} for order in ORDERS}
    texture = Texture(MATERIALS["wood"].vibration, "slide", 1)
    texture.render(9600, RUBBED)
    works: dict[str, Callable[[], object]] = {
        LOOP: partial(texture.render, 128, RUBBED),
        **{
            f"AR {order}": partial(filtered, *filters[order]["wood"], 128 / RATE_HZ)
            for order in ORDERS
        },
    }
    costs = _least_us(works)
    rows = [_row("noise", LOOP, loop, costs[LOOP])]
    for order in ORDERS:
        errors = {
            name: difference_db(meant[name], steady_db(filtered(*filters[order][name], STEADY_S)))
            for name in NAMES
        }
        rows.append(_row("noise", f"AR {order}", errors, costs[f"AR {order}"]))
    return rows


def blocks() -> list[Row]:
    """Render two rubbing hands in blocks; each contact waits for the next block."""
    meant = steady_db(_moving(1))
    costs = _least_us({size: partial(_two_hands().render, size, 0.0) for size in BLOCKS})
    rows = []
    for size in BLOCKS:
        errors = {"two hands, 75 contacts a second": difference_db(meant, steady_db(_moving(size)))}
        row = _row("block", str(size), errors, costs[size])
        seconds = size / RATE_HZ
        share = costs[size] * 1e-6 / seconds
        rows.append(replace(row, delay_ms=1e3 * seconds, core_share=share))
    return rows


DEFAULTS = {"modes": SHIPPED, "noise": LOOP, "block": "128"}


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


def rub(name: str, seed: int) -> Wave:
    """Rub a surface for STEADY_S as the product does."""
    texture = Texture(MATERIALS[name].vibration, "slide", seed)
    texture.render(9600, RUBBED)
    return texture.render(int(STEADY_S * RATE_HZ), RUBBED)


def fit(wave: Wave, order: int) -> tuple[NDArray[np.float64], float]:
    """Fit an AR model at AR_RATE_HZ by Yule and Walker: its taps (order + 1,) and gain."""
    few = signal.decimate(signal.decimate(wave.astype(np.float64), 4), 3)
    lags = np.array([np.dot(few[: few.size - n], few[n:]) / few.size for n in range(order + 1)])
    lags[0] *= 1.0 + 1e-6
    taps = linalg.solve_toeplitz(lags[:order], lags[1:])
    return np.concatenate(([1.0], -taps)), float(np.sqrt(max(lags[0] - taps @ lags[1:], 0.0)))


def filtered(taps: NDArray[np.float64], gain: float, seconds: float) -> Wave:
    """Run noise through an AR model, seconds of it at RATE_HZ."""
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


def _strike(body: Vibration) -> Wave:
    return impact(body, "strike", Motion(1.0, 1.0), 0)


def _least_us(works: Mapping[K, Callable[[], object]]) -> dict[K, float]:
    return least_us(works, ROUNDS, times=20)
