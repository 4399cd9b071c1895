"""What a palm feels of a rendition beside the true material.

A touch is a strike, then a slide of a second. The skin's difference from the true material is given
in degC.

Whether a person would take the touch for the true material is predicted by the observer of channels
(`telling_apart`), a model that nobody has checked on a person.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from thermal_reference import Stage, contact_surface

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import thermal_contact
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.session.decisions import Rendition
from hapticvlm_lab.bench.telling_apart import (
    HEAT_NOISE,
    TOUCH_NOISE,
    vibration_steps,
    warmth_steps,
)
from hapticvlm_lab.bench.thermal import TICK_S, with_memory
from hapticvlm_lab.bench.vibration.spectra import rub

ROOM_C = 22.0
TOUCH_S = 1.0
STRIKE = Motion(1.0, 1.0)
SEED = 11
TRIALS = 2000
Doubles = NDArray[np.float64]
Wave = NDArray[np.float32]
Vibrating = tuple[str | None, float]  # a material, None for none, and its gain

_TIMES_S: Doubles = np.arange(1.0, round(TOUCH_S / TICK_S) + 1.0) * TICK_S


@dataclass(frozen=True, slots=True)
class Felt:
    """Mean difference of the skin, degC; share of trials with the right answer."""

    skin_c: float
    recognised: float


def felt(rendition: Rendition, truth: str) -> Felt:
    """Compare a rendition with the true material, one of the table."""
    bulk, _ = rendition.thermal(ROOM_C, MATERIALS)
    return _felt(bulk, rendition.texture, rendition.impact, truth)


@cache
def _felt(bulk: Thermal | None, texture: Vibrating, impact: Vibrating, truth: str) -> Felt:
    skin_c = _followed(bulk)
    answers = _answers(_percept(skin_c, _at(_slide, texture), _at(_strike, impact)))
    return Felt(
        float(np.abs(skin_c - _true_skin(truth)).mean()),
        float(answers[list(MATERIALS).index(truth)]),
    )


def _percept(skin_c: Doubles, slide: Wave, strike: Wave) -> Doubles:
    """Return the observer's description of a touch, (F,), in units of its noise."""
    # Each channel is divided by its own noise, so that a step of one unit is equally noticeable in
    # all of them, and the distance of two descriptions is a number of such units.
    waves = (strike, slide[: round(TOUCH_S * RATE_HZ)])
    touch = [vibration_steps(wave, RATE_HZ) / TOUCH_NOISE for wave in waves]
    rested_c = np.concatenate(([NEUTRAL_C], skin_c))
    return np.concatenate((*touch, warmth_steps(rested_c, TICK_S) / HEAT_NOISE))


def _answers(percept: Doubles) -> Doubles:
    """Return how often each material is nearest to the description with noise, (C,)."""
    # The same noise for every touch: two renditions then differ by themselves.
    rng = np.random.default_rng(SEED)
    observed = percept + rng.standard_normal((TRIALS, percept.size))
    templates = _templates()
    # |observed - template|^2 without its first term, which is the same for all templates.
    distances = (templates**2).sum(axis=1) - 2.0 * observed @ templates.T
    return np.asarray(np.bincount(distances.argmin(axis=1), minlength=len(templates)) / TRIALS)


@cache
def _templates() -> Doubles:
    """Return the observer's memory of each material of the table, (C, F)."""
    return np.array([_percept(_true_skin(name), _slide(name), _strike(name)) for name in MATERIALS])


@cache
def _true_skin(name: str) -> Doubles:
    return contact_surface(thermal_contact(MATERIALS[name].thermal, ROOM_C), _TIMES_S)


@cache
def _followed(bulk: Thermal | None) -> Doubles:
    if bulk is None:
        return np.full(_TIMES_S.size, NEUTRAL_C)
    return with_memory([Stage(0.0, thermal_contact(bulk, ROOM_C))], _TIMES_S)


def _at(wave: Callable[[str], Wave], what: Vibrating) -> Wave:
    """Return the wave of a material at its gain; silence if there is no material."""
    name, gain = what
    return np.float32(0.0 if name is None else gain) * wave(name or next(iter(MATERIALS)))


@cache
def _slide(name: str) -> Wave:
    return rub(name)


@cache
def _strike(name: str) -> Wave:
    return impact(MATERIALS[name].vibration, "strike", STRIKE, 0)
