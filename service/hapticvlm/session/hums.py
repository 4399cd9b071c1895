"""The hum that a hand feels of objects that vibrate by themselves, through those in contact. Pure.

An object vibrates as the scene states, or as its name implies. A hand on it feels it at full level.
A hand on an object that it stands on, or on another one that stands there too, feels it weaker. A
hand without such a path to it feels nothing: vibration does not pass through air here. The path
from the source to the hand costs

    JOINT_DB for each contact between two objects, more on a thick object and less on a thin one:
    the force of the source moves a plate by 1 / thickness^2 (its mobility), relative to USUAL_M;
    10 log10(r / NEAR_M), as a wave in a plate spreads;
    8.69 pi f loss r / SPEED_MPS, as the material damps it (loss = decay / (pi f), first mode),

with r = CROSSED_M for each object on the path but the source: where others stand on it is unknown.
The law's form is that of bending waves in a plate; its figures are our choice, such that a machine
that is felt through a kitchen table is felt here (docs/physics.md 4.7). A hum under the palm's
threshold is left out, since nobody would feel it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from hapticvlm.evidence.hums import hum_of
from hapticvlm.materials import Vibration
from hapticvlm.messages import SceneObject
from hapticvlm.rendering.vibration.hum import Hum

JOINT_DB = 4.0
USUAL_M = 0.02  # of a table top; of an object whose thickness is not known
THICKER_DB = (-6.0, 12.0)  # limits of what a thickness changes: no object is a plate throughout
NEAR_M = 0.05
CROSSED_M = 0.4
SPEED_MPS = 500.0
_MOST_CROSSED = 4  # objects: even the strongest hum is not felt through more
RICHNESS = 0.3  # of what a scene states: it gives no harmonics
_MAX_OBJECTS = 256  # asked for one hand, so that a crowded table holds up no touch

FactsOf = Callable[[str], SceneObject | None]
MaterialOf = Callable[[str], Vibration | None]


class Hums:
    """The contacts between objects of one scene, and the hum felt on each, until they change."""

    def __init__(self) -> None:
        self._stands_on: dict[str, tuple[str, ...]] = {}
        self._touching: dict[str, set[str]] = {}
        self.kept: dict[str, Hum | None] = {}  # what is felt of each object asked for

    def clear(self) -> None:
        """Forget all of it."""
        self._stands_on.clear()
        self._touching.clear()
        self.kept.clear()

    def declare(self, objects: Iterable[SceneObject]) -> None:
        """Receive what carries these objects, in place of what did before."""
        self.kept.clear()
        for given in objects:
            if given.object_id in self._stands_on:
                self._lift(given.object_id)
            if given.stands_on:
                self._put(given.object_id, tuple(given.stands_on))

    def forget(self, object_id: str) -> None:
        """Lift an object off what carries it."""
        self.kept.clear()
        self._lift(object_id)

    def _put(self, object_id: str, supports: tuple[str, ...]) -> None:
        self._stands_on[object_id] = supports
        for support in supports:
            self._touching.setdefault(object_id, set()).add(support)
            self._touching.setdefault(support, set()).add(object_id)

    def _lift(self, object_id: str) -> None:
        for support in self._stands_on.pop(object_id, ()):
            self._touching.get(support, set()).discard(object_id)
            self._touching.get(object_id, set()).discard(support)

    def felt(self, object_id: str, facts_of: FactsOf, material_of: MaterialOf) -> Hum | None:
        """Return what a hand on this object feels of all that vibrates: the strongest of it."""
        if object_id not in self.kept:
            self.kept[object_id] = self._strongest(object_id, facts_of, material_of)
        return self.kept[object_id]

    def _strongest(self, object_id: str, facts_of: FactsOf, material_of: MaterialOf) -> Hum | None:
        strongest: Hum | None = None
        for source, path in self._paths(object_id).items():
            hum = _hum_of(facts_of(source))
            if hum is None:
                continue
            loss_db = _loss_db(path, hum.frequency_hz, facts_of, material_of)
            passed = Hum(hum.frequency_hz, hum.level * 10.0 ** (-loss_db / 20.0), hum.richness)
            if passed.sensation_db() < 0.0:
                continue
            if strongest is None or passed.level > strongest.level:
                strongest = passed
        return strongest

    def _paths(self, object_id: str) -> dict[str, tuple[str, ...]]:
        """Return the path from the hand to each object near it; () for the touched one."""
        paths: dict[str, tuple[str, ...]] = {object_id: ()}
        edge = [object_id]
        while edge:
            reached = []
            for name in edge:
                for other in sorted(self._touching.get(name, ())):
                    if other not in paths and len(paths) < _MAX_OBJECTS:
                        paths[other] = (*paths[name], name)
                        reached.append(other)
            edge = [name for name in reached if len(paths[name]) < _MOST_CROSSED]
        return paths


def _hum_of(given: SceneObject | None) -> Hum | None:
    """Return how an object vibrates by itself: as the scene states, else as its name says."""
    if given is None:
        return None
    stated = given.vibrates
    if stated is not None:
        return Hum(stated.frequency_hz, stated.level, RICHNESS) if stated.on else None
    named = hum_of(given.name or given.object_id)
    return None if named is None else Hum(named.frequency_hz, named.level, named.richness)


def _loss_db(
    path: tuple[str, ...], frequency_hz: float, facts_of: FactsOf, material_of: MaterialOf
) -> float:
    if not path:
        return 0.0
    crossed_m = CROSSED_M * len(path)
    joints_db = sum(JOINT_DB + _thicker_db(facts_of(name)) for name in path)
    damped_db = sum(_damped_db_per_m(material_of(name), frequency_hz) for name in path) * CROSSED_M
    return joints_db + 10.0 * math.log10(crossed_m / NEAR_M) + damped_db


def _thicker_db(facts: SceneObject | None) -> float:
    """Return by how much less this object moves than one of USUAL_M, dB."""
    if facts is None or facts.thickness_m is None:
        return 0.0
    least_db, most_db = THICKER_DB
    return min(max(40.0 * math.log10(facts.thickness_m / USUAL_M), least_db), most_db)


def _damped_db_per_m(vibration: Vibration | None, frequency_hz: float) -> float:
    if vibration is None:
        return 0.0
    mode = vibration.modes[0]
    loss = mode.decay_per_s / (math.pi * mode.frequency_hz)
    return 8.69 * math.pi * frequency_hz * loss / SPEED_MPS
