"""The ladder: evidence in order of cost, when to stop climbing, and what to say. Pure.

Each rung gives a distribution over materials, p_r(m). Rungs look at different things (a name, a
shader, pixels), so they are pooled log-linearly, p(m) ~ prod_r p_r(m)^w_r, where w_r < 1 discounts
a rung for leaning on the same hints as the others. What the beliefs of an evidence leave open is
spread evenly over all classes, so a rung that knows nothing pulls towards nothing. Knows neither
pictures nor objects, and keeps no state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hapticvlm import materials, messages

Rung = messages.Rung

SURE = 0.8  # belief at which a rung, or the pool, needs no further rung
KNOWN = 0.5  # pooled belief below which the answer is unknown: more likely wrong than right
FLIP_MARGIN = 0.15  # lead in belief a new material needs over the one already felt
FLOOR = 1e-4  # least belief any rung may hold: no rung can veto a material for good

_ORDER: tuple[Rung, ...] = ("scene", "name", "shader", "encoder", "vlm", "unknown")
# Exponents of the pool. Names and shaders come from the same person, so beside a name a shader
# adds less; alone it counts in full.
_WEIGHT: Mapping[Rung, float] = {
    "scene": 1.0,
    "name": 1.0,
    "shader": 0.7,
    "encoder": 1.0,
    "vlm": 1.0,
    "unknown": 0.0,
}


@dataclass(frozen=True, slots=True)
class Evidence:
    """What one rung says: (material, probability) best first, summing to at most 1.

    The mass the beliefs leave open belongs to no class: it is what the rung does not know.
    """

    rung: Rung
    beliefs: tuple[tuple[str, float], ...]

    @property
    def material(self) -> str | None:
        """The most probable material, None when the rung says nothing."""
        return self.beliefs[0][0] if self.beliefs else None

    @property
    def confidence(self) -> float:
        """Belief in `material`, 0..1; 0 when the rung says nothing."""
        return self.beliefs[0][1] if self.beliefs else 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the ladder decided. An unknown material still names its best guess as `runner_up`.

    `confidence` is the posterior of the best material, also where that was not enough to say it.
    """

    material: str
    confidence: float
    runner_up: str | None
    source: Rung
    evidence: tuple[Evidence, ...]


def is_sure(evidence: Sequence[Evidence]) -> bool:
    """Whether climbing can stop: the scene spoke, a rung is sure, or all together are."""
    if _statement(evidence) is not None:
        return True
    return max(pool(evidence).values()) >= SURE


def decide(evidence: Sequence[Evidence]) -> Verdict:
    """Judge what was gathered so far; unknown when nothing is believed enough."""
    posterior = pool(evidence)
    best, second = sorted(posterior, key=lambda name: -posterior[name])[:2]
    spoken = _statement(evidence)
    confidence = min(1.0, posterior[best])
    if not any(item.beliefs for item in evidence):
        return Verdict(materials.UNKNOWN, 0.0, None, "unknown", tuple(evidence))
    if spoken is None and confidence < KNOWN:
        return Verdict(materials.UNKNOWN, confidence, best, "unknown", tuple(evidence))
    source = spoken.rung if spoken is not None else _heaviest(evidence, best)
    runner_up = second if posterior[second] > FLOOR else None
    return Verdict(best, confidence, runner_up, source, tuple(evidence))


def prefer(previous: Verdict | None, new: Verdict) -> Verdict:
    """Hysteresis: the material already felt stays unless the new one leads it by FLIP_MARGIN."""
    if previous is None or previous.material == new.material or new.source == "scene":
        return new
    if previous.material == materials.UNKNOWN:
        return new
    posterior = pool(new.evidence)
    held = posterior.get(previous.material, FLOOR)
    bar = KNOWN if new.material == materials.UNKNOWN else new.confidence
    if bar - held > FLIP_MARGIN:
        return new
    rival = new.runner_up if new.material == materials.UNKNOWN else new.material
    rival = None if rival == previous.material else rival
    return Verdict(previous.material, min(1.0, held), rival, previous.source, new.evidence)


def fuse(views: Sequence[Evidence]) -> Evidence:
    """Several looks at one object as one encoder evidence: the mean of their beliefs.

    The mean, not the product: views of one object repeat each other's errors.
    """
    named = sorted({name for view in views for name, _ in view.beliefs})
    beliefs = [dict(view.beliefs) for view in views]
    means = {name: sum(b.get(name, 0.0) for b in beliefs) / len(views) for name in named}
    ranked = sorted(means.items(), key=lambda item: (-item[1], item[0]))
    return Evidence("encoder", tuple(ranked))


def pool(evidence: Sequence[Evidence]) -> dict[str, float]:
    """Belief in every class after all evidence: the posterior, which sums to 1."""
    named = [name for item in evidence for name, _ in item.beliefs]
    spoken = _statement(evidence)
    telling = [item for item in evidence if item.beliefs]
    if spoken is not None or len(telling) == 1:
        return _spread(spoken or telling[0], named)
    logs = dict.fromkeys(_classes(named), 0.0)
    for item in telling:
        for name, belief in _hedge(item, named).items():
            logs[name] += _weight(item.rung, evidence) * math.log(max(belief, FLOOR))
    top = max(logs.values())
    total = sum(math.exp(value - top) for value in logs.values())
    return {name: math.exp(value - top) / total for name, value in logs.items()}


def _statement(evidence: Sequence[Evidence]) -> Evidence | None:
    """Find the scene's word, else the first rung in order of cost that is sure by itself."""
    for rung in _ORDER:
        for item in evidence:
            if item.rung == rung and item.beliefs and (rung == "scene" or item.confidence >= SURE):
                return item
    return None


def _weight(rung: Rung, evidence: Sequence[Evidence]) -> float:
    has_name = any(item.rung == "name" and item.beliefs for item in evidence)
    return 1.0 if rung == "shader" and not has_name else _WEIGHT[rung]


def _spread(item: Evidence, named: Sequence[str]) -> dict[str, float]:
    """Fill a lone evidence up to a distribution: what it leaves open goes to the others alike."""
    beliefs = dict(item.beliefs)
    classes = _classes([*named, *beliefs])
    others = [name for name in classes if name not in beliefs] or classes
    rest = max(0.0, 1.0 - sum(beliefs.values())) / len(others)
    return {name: beliefs.get(name, 0.0) + (rest if name in others else 0.0) for name in classes}


def _hedge(item: Evidence, named: Sequence[str]) -> dict[str, float]:
    """Fill an evidence up for the pool: what it leaves open goes to all classes alike.

    To all, also to those it names: a rung that believes its own best guess at 2 % and nothing else
    must not thereby speak against it.
    """
    beliefs = dict(item.beliefs)
    classes = _classes([*named, *beliefs])
    rest = max(0.0, 1.0 - sum(beliefs.values())) / len(classes)
    return {name: beliefs.get(name, 0.0) + rest for name in classes}


def _classes(named: Sequence[str]) -> tuple[str, ...]:
    """Every class of the table, and those a user's gallery or scene adds."""
    return tuple(dict.fromkeys((*materials.MATERIALS, *named)))


def _heaviest(evidence: Sequence[Evidence], material: str) -> Rung:
    """Find the rung that speaks most for the material, against knowing nothing."""
    named = [name for item in evidence for name, _ in item.beliefs]

    def weight(item: Evidence) -> float:
        belief = _hedge(item, named)[material]
        return _weight(item.rung, evidence) * math.log(max(belief, FLOOR) * len(_classes(named)))

    return max((item for item in evidence if item.beliefs), key=weight).rung
