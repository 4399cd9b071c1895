"""What a palm feels of a rendition, against what it would feel of the true material.

A touch is a strike, then a slide of a second. Its differences from the true material are given in
degC of the skin, and in dB of the vibration, which saturate at some 6 dB: that is silence. How
often it is taken for the true material is predicted by the machine observer of `study predict`, at
the noise at which it confuses as many of the paper's patterns as people did. No person was asked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import thermal_contact
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.session.rendition import Rendition
from hapticvlm_lab.bench.thermal import chart as heat
from hapticvlm_lab.bench.thermal.chart import TICK_S
from hapticvlm_lab.bench.thermal.reference import contact_surface
from hapticvlm_lab.bench.vibration import chart as vibration
from hapticvlm_lab.bench.vibration.spectra import difference_db, event_db, steady_db
from hapticvlm_studio.observer.channels import vibration_steps
from hapticvlm_studio.observer.percepts import Noise, warmth_steps
from hapticvlm_studio.observer.predict import paper_noise

ROOM_C = 22.0
TOUCH_S = 1.0
BLOCK = 128
STRUCK = Motion(1.0, 1.0)
SEED = 11
TRIALS = 2000
Doubles = NDArray[np.float64]
Wave = NDArray[np.float32]
Vibrating = tuple[str | None, float]

_TIMES_S: Doubles = np.arange(1.0, round(TOUCH_S / TICK_S) + 1.0) * TICK_S


@dataclass(frozen=True, slots=True)
class Vibration:
    """A way to render vibration: at most so many modes a strike, noise by AR of this order."""

    name: str
    modes: int | None = None
    order: int | None = None


@dataclass(frozen=True, slots=True)
class Rendering:
    """A way to follow the skin, and one to vibrate."""

    heat: heat.Method
    vibration: Vibration


@dataclass(frozen=True, slots=True)
class Felt:
    """Mean difference of the skin, degC, of the vibration, dB; how often it is taken as it is."""

    skin_c: float
    texture_db: float
    recognised: float


AS_SHIPPED = Vibration("as shipped")
OTHER_VIBRATIONS = (
    Vibration("1 mode a strike", modes=1),
    Vibration("noise by AR 2", order=2),
    Vibration("noise by AR 32", order=32),
)
OTHER_HEATS = ("contact temperature",)
DEFAULT = Rendering(next(method for method in heat.METHODS if method.is_default), AS_SHIPPED)


def renderings() -> list[Rendering]:
    """List the default, then those that differ from it in one thing."""
    heats = [method for method in heat.METHODS if method.name in OTHER_HEATS]
    others = [replace(DEFAULT, heat=method) for method in heats]
    others += [replace(DEFAULT, vibration=each) for each in OTHER_VIBRATIONS]
    return [DEFAULT, *others]


def felt(rendition: Rendition, truth: str, how: Rendering) -> Felt:
    """Compare a rendition with the true material, one of the table."""
    bulk, _ = rendition.thermal(ROOM_C, MATERIALS)
    return _felt(bulk, rendition.texture, rendition.impact, truth, how)


@cache
def _felt(
    bulk: Thermal | None, texture: Vibrating, impact: Vibrating, truth: str, how: Rendering
) -> Felt:
    skin_c = _followed(bulk, how.heat)
    slide, strike = _at(_slide, texture, how.vibration), _at(_strike, impact, how.vibration)
    slide_db = difference_db(steady_db(_slide(truth, AS_SHIPPED)), steady_db(slide))
    strike_db = difference_db(event_db(_strike(truth, AS_SHIPPED)), event_db(strike))
    chosen = _chosen(_percept(skin_c, slide, strike))
    return Felt(
        float(np.abs(skin_c - _true_skin(truth)).mean()),
        (slide_db + strike_db) / 2.0,
        float(chosen[list(MATERIALS).index(truth)]),
    )


def _percept(skin_c: Doubles, slide: Wave, strike: Wave) -> Doubles:
    """Return what the observer takes from a touch, (F,), in units of its noise."""
    noise = _noise()
    waves = (strike, slide[: round(TOUCH_S * RATE_HZ)])
    touch = [vibration_steps(wave, RATE_HZ) / noise.touch for wave in waves]
    rested_c = np.concatenate(([NEUTRAL_C], skin_c))
    return np.concatenate((*touch, warmth_steps(rested_c, TICK_S) / noise.heat))


def _chosen(percept: Doubles) -> Doubles:
    """Return how often each material is the nearest one to what is felt with noise, (C,)."""
    rng = np.random.default_rng(SEED)
    observed = percept + rng.standard_normal((TRIALS, percept.size))
    templates = _templates()
    apart = (templates**2).sum(axis=1) - 2.0 * observed @ templates.T
    return np.asarray(np.bincount(apart.argmin(axis=1), minlength=len(templates)) / TRIALS)


@cache
def _templates() -> Doubles:
    """Return what the observer remembers of each material as the table has it, (C, F)."""
    as_meant = [
        _percept(_true_skin(name), _slide(name, AS_SHIPPED), _strike(name, AS_SHIPPED))
        for name in MATERIALS
    ]
    return np.array(as_meant)


@cache
def _noise() -> Noise:
    return paper_noise()


@cache
def _true_skin(name: str) -> Doubles:
    return contact_surface(thermal_contact(MATERIALS[name].thermal, ROOM_C), _TIMES_S)


@cache
def _followed(bulk: Thermal | None, method: heat.Method) -> Doubles:
    if bulk is None:
        return np.full(_TIMES_S.size, NEUTRAL_C)
    skin = method.begin(TICK_S)
    skin.touch(thermal_contact(bulk, ROOM_C))
    return np.array([skin.step() for _ in _TIMES_S])


def _at(wave: Callable[[str, Vibration], Wave], what: Vibrating, how: Vibration) -> Wave:
    """Return the wave of what vibrates at its gain; silence, if nothing does."""
    name, gain = what
    return np.float32(0.0 if name is None else gain) * wave(name or next(iter(MATERIALS)), how)


@cache
def _slide(name: str, how: Vibration) -> Wave:
    wave = vibration.rub(name, seed=1)
    if how.order is None:
        return wave
    return vibration.filtered(*vibration.fit(wave, how.order), vibration.STEADY_S)


@cache
def _strike(name: str, how: Vibration) -> Wave:
    body = MATERIALS[name].vibration
    if how.modes is not None:
        body = replace(body, modes=body.modes[: how.modes])
    return impact(body, "strike", STRUCK, 0)


def work(how: Rendering) -> Mapping[str, Callable[[], object]]:
    """Return what one touch of TOUCH_S computes: a strike, then heat and a slide, on wood."""
    wood = MATERIALS["wood"]
    contact = thermal_contact(wood.thermal, ROOM_C)
    body = replace(wood.vibration, modes=wood.vibration.modes[: how.vibration.modes])
    texture = Texture(wood.vibration, "slide", 1)
    blocks = round(TOUCH_S * RATE_HZ / BLOCK)
    order = how.vibration.order
    model = None if order is None else vibration.fit(vibration.rub("wood", seed=1), order)

    def follow() -> None:
        skin = how.heat.begin(TICK_S)
        skin.touch(contact)
        for _ in _TIMES_S:
            skin.step()

    def slide() -> None:
        for _ in range(blocks):
            if model is None:
                texture.render(BLOCK, vibration.RUBBED)
            else:
                vibration.filtered(*model, BLOCK / RATE_HZ)

    return {"heat": follow, "slide": slide, "strike": lambda: impact(body, "strike", STRUCK, 0)}
