"""Pools evidence on a material, decides when it suffices, and gives the verdict. Pure.

*Pooling rungs.* Each rung (the scene's statement, a name, a shader, a texture map, pixels, a VLM)
gives a belief b_r(m) in each of C materials and leaves u_r = 1 - sum b_r open. Rungs observe
different things, so their beliefs are multiplied, as independent evidence is: the pool is
log-linear. The open part of a rung is first spread evenly, so that what it does not know is no
evidence against anything. The product then contains the case that all rungs know nothing, which is
subtracted again and stays open, so that a single rung is believed as it is:

  p(m) ~ prod_r (b_r(m) + u_r / C)^w_r - prod_r (u_r / C)^w_r.

A weight w_r < 1 discounts a rung that relies on the same hints as another one. Hence a rung that
knows nothing changes nothing, and a rung that agrees never lowers a belief.

*Fusing recognitions.* Several recognitions of one object by the same encoder are not independent:
neighbouring frames repeat each other's errors, and a product would soon be surer than it is right.
So they are averaged, and the newest counts at least 1 / MEMORY. When CHANGE recognitions in a row
find the same other material, the object itself has changed and the average starts again. A poor
picture needs no smaller weight, because its beliefs leave much open.

Compared and rejected: short and moving averages (2 to 6 times the flips for as quick a change),
products with an exponent and a Bayes filter (overconfident), the mean embedding (its best guess is
not better, and evidence would have to hold it), weights by size or sharpness (no gain). Knows
neither pictures nor objects, and keeps no state.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from hapticvlm import materials, messages

Rung = messages.Rung

SURE = 0.8  # belief at which a rung, or the pool, needs no further rung
KNOWN = 0.5  # pooled belief below which the answer is unknown: more likely wrong than right
FLIP_MARGIN = 0.15  # lead in belief that a new material needs over the one already rendered
FLOOR = 1e-4  # least belief of a rung in any material, so that no rung can exclude it

# Names and shaders are set by the same person. A name that leaves nothing open reduces a shader's
# exponent by this much. All other exponents are 1.
SHARED_HINTS = 0.3

# A frame shows the texture map on its object, and one network reads both. A map that leaves nothing
# open reduces the encoder's exponent by this much: our choice.
SHARED_PIXELS = 0.5

# For recognitions of one object; chosen on drifting crops of training pictures, none of them held
# back.
MEMORY = 32  # recognitions that count equally; older ones fade
CHANGE = 4  # in a row: fewer would flip during blurred frames, more would delay a change

_ORDER: tuple[Rung, ...] = ("scene", "name", "shader", "texture", "encoder", "vlm", "unknown")


@dataclass(frozen=True, slots=True)
class Evidence:
    """The beliefs of one rung: (material, probability), best first, summing to at most 1.

    The rest to 1 belongs to no class: it is what the rung does not know.
    """

    rung: Rung
    beliefs: tuple[tuple[str, float], ...]

    @property
    def material(self) -> str | None:
        """The most probable material; None if the rung has no beliefs."""
        return self.beliefs[0][0] if self.beliefs else None

    @property
    def confidence(self) -> float:
        """The belief in `material`, 0..1; 0 if the rung has no beliefs."""
        return self.beliefs[0][1] if self.beliefs else 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """The ladder's decision; if `material` is unknown, `runner_up` is its best guess, if any.

    `confidence` is the posterior of the best material, even if it was too low to name it. People
    and animals (LIVING) are believed in, but never named. `beliefs` is the posterior of every
    class, empty if no rung has beliefs. It follows from the evidence, so it is left out of
    comparisons.
    """

    material: str
    confidence: float
    runner_up: str | None
    source: Rung
    evidence: tuple[Evidence, ...]
    beliefs: Mapping[str, float] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Fused:
    """Fused evidence on one object, the count of its recognitions, and contradicting ones."""

    evidence: Evidence
    count: int
    contradicting: tuple[Evidence, ...] = ()


def ranked(rung: Rung, beliefs: Mapping[str, float]) -> Evidence:
    """Return beliefs as evidence, best first and rounded, whatever their order was."""
    best_first = sorted(beliefs.items(), key=lambda item: (-item[1], item[0]))
    return Evidence(rung, tuple((name, round(p, 4)) for name, p in best_first))


def restrict(item: Evidence, among: Collection[str] | None) -> Evidence:
    """Restrict beliefs to these materials (None: all) and scale them up by the mass of the others.

    The open part counts as one more candidate and grows in scale too.
    """
    if among is None:
        return item
    among = {*among, materials.LIVING}  # people and animals are in any scene
    kept = [(name, belief) for name, belief in item.beliefs if name in among]
    possible = 1.0 - sum(belief for name, belief in item.beliefs if name not in among)
    if not kept or possible <= FLOOR:
        return Evidence(item.rung, ())
    return Evidence(item.rung, tuple((name, belief / possible) for name, belief in kept))


def is_sure(evidence: Sequence[Evidence]) -> bool:
    """Whether no further rung is needed: the scene stated it, or a rung or the pool is sure."""
    statement = _statement(_informative(evidence))
    return statement is not None or max(pool(evidence).values()) >= SURE


def with_children(
    beliefs: Mapping[str, float], table: Mapping[str, materials.Material]
) -> dict[str, float]:
    """Count what is believed in a user's material as belief in its class, unless it is KNOWN.

    Walnut is wood: pictures between the two are no doubt about wood, so both are one belief until
    the child passes by itself.
    """
    joined = dict(beliefs)
    for name, belief in beliefs.items():
        parent = table[name].like if name in table else None
        if parent is not None and parent in beliefs and belief < KNOWN:
            joined[parent] += joined.pop(name)
    return joined


def decide(
    evidence: Sequence[Evidence], table: Mapping[str, materials.Material] = materials.MATERIALS
) -> Verdict:
    """Return the verdict on the evidence so far; unknown if no belief reaches KNOWN.

    `table` has the user's materials, too, each of which is within its class (`with_children`).
    """
    gathered = tuple(evidence)
    informative = _informative(evidence)
    if not informative:
        return Verdict(materials.UNKNOWN, 0.0, None, "unknown", gathered, {})
    statement = _statement(informative)
    posterior = with_children(_posterior(informative, statement), table)
    named = [name for name in posterior if name != materials.LIVING]
    best, second = sorted(named, key=lambda name: -posterior[name])[:2]
    confidence = posterior[best]
    is_open = statement is None or statement.material == materials.LIVING
    if is_open and confidence < KNOWN:
        guess = best if posterior.get(materials.LIVING, 0.0) <= confidence else None
        return Verdict(materials.UNKNOWN, confidence, guess, "unknown", gathered, posterior)
    source = statement.rung if statement is not None else _heaviest(informative, best)
    runner_up = second if posterior[second] > FLOOR else None
    return Verdict(best, confidence, runner_up, source, gathered, posterior)


def apply_hysteresis(previous: Verdict | None, new: Verdict) -> Verdict:
    """Keep the previous material unless the new one leads it by FLIP_MARGIN."""
    if previous is None or previous.material == new.material or new.source == "scene":
        return new
    if previous.material == materials.UNKNOWN:
        return new
    held = new.beliefs.get(previous.material, 0.0)
    bar = KNOWN if new.material == materials.UNKNOWN else new.confidence
    if bar - held > FLIP_MARGIN:
        return new
    rival = new.runner_up if new.material == materials.UNKNOWN else new.material
    rival = None if rival == previous.material else rival
    return Verdict(previous.material, held, rival, previous.source, new.evidence, new.beliefs)


def fuse(views: Sequence[Evidence]) -> Evidence:
    """Fuse several views of one object to one encoder evidence, the mean of their beliefs."""
    named = sorted({name for view in views for name, _ in view.beliefs})
    beliefs = [dict(view.beliefs) for view in views]
    means = {name: sum(b.get(name, 0.0) for b in beliefs) / len(views) for name in named}
    ranked = sorted(means.items(), key=lambda item: (-item[1], item[0]))
    return Evidence("encoder", tuple(ranked))


def fuse_recognition(before: Fused | None, newest: Evidence) -> Fused:
    """Fuse one more recognition; bounded by MEMORY, CHANGE and the number of materials."""
    if before is None:
        return Fused(newest, 1)
    contradicting = _contradicting(before, newest)
    if len(contradicting) == CHANGE:
        return Fused(fuse(contradicting), CHANGE)
    count = min(before.count + 1, MEMORY)
    return Fused(_running_mean(before.evidence, newest, 1.0 / count), count, contradicting)


def fuse_recognitions(recognitions: Iterable[Evidence]) -> Evidence:
    """Fuse recognitions in the order of their frames."""
    fused: Fused | None = None
    for evidence in recognitions:
        fused = fuse_recognition(fused, evidence)
    return fused.evidence if fused else Evidence("encoder", ())


def pool(evidence: Sequence[Evidence]) -> dict[str, float]:
    """Return the posterior of every class after all evidence; what it lacks to 1 is unknown."""
    informative = _informative(evidence)
    return _posterior(informative, _statement(informative))


def _informative(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Return the evidence that has beliefs, in a fixed order: sums and ties are reproducible."""
    kept = [item for item in evidence if any(belief > 0.0 for _, belief in item.beliefs)]
    return sorted(kept, key=lambda item: (_ORDER.index(item.rung), item.beliefs))


def _statement(informative: Sequence[Evidence]) -> Evidence | None:
    """Return the scene's statement, else the first rung in order of cost that is sure by itself."""
    for item in informative:
        if item.rung == "scene" or item.confidence >= SURE:
            return item
    return None


def _posterior(informative: Sequence[Evidence], statement: Evidence | None) -> dict[str, float]:
    if statement is None:
        return _product(informative)
    if statement.rung == "scene":
        informative = [statement]
    return _with_statement(_product(informative), statement.material or "", informative)


def _product(informative: Sequence[Evidence]) -> dict[str, float]:
    classes = _classes(informative)
    logs = dict.fromkeys(classes, 0.0)
    all_open = 0.0  # logarithm of prod_r (u_r / C)^w_r: no rung knows the material
    for item in informative:
        weight = _weight(item, informative)
        beliefs = dict(item.beliefs)
        share = _share(item, classes)
        all_open += weight * math.log(max(share, sys.float_info.min))
        for name in classes:
            logs[name] += weight * math.log(max(beliefs.get(name, 0.0) + share, FLOOR))
    # Scaled by the largest before leaving the logarithms, so that the powers do not underflow.
    top = max(logs.values())
    powers = {name: math.exp(value - top) for name, value in logs.items()}
    total = sum(powers.values())
    rest = math.exp(min(0.0, all_open - top))
    return {name: max(0.0, power - rest) / total for name, power in powers.items()}


def _with_statement(
    posterior: Mapping[str, float], material: str, informative: Sequence[Evidence]
) -> dict[str, float]:
    """Raise a sure rung's material to the largest belief of any rung; scale the others down."""
    confidences = [item.confidence for item in informative if item.material == material]
    belief = min(1.0, max(posterior[material], *confidences))
    others = sum(posterior.values()) - posterior[material]
    scale = min(1.0, (1.0 - belief) / others) if others > 0.0 else 0.0
    return {name: belief if name == material else p * scale for name, p in posterior.items()}


def _weight(item: Evidence, informative: Sequence[Evidence]) -> float:
    if item.rung == "unknown":
        return 0.0
    if item.rung == "shader":
        return 1.0 - SHARED_HINTS * _mass("name", informative)
    if item.rung == "encoder":
        return 1.0 - SHARED_PIXELS * _mass("texture", informative)
    return 1.0


def _mass(rung: Rung, informative: Sequence[Evidence]) -> float:
    """Return the part of the belief that this rung does not leave open, 0 where it is absent."""
    sums = [sum(belief for _, belief in item.beliefs) for item in informative if item.rung == rung]
    return min(1.0, max(sums, default=0.0))


def _share(item: Evidence, classes: Sequence[str]) -> float:
    """Return each class's share of what the beliefs leave open, the same for all classes.

    Named classes get it too: a rung whose only belief is 2 % is not evidence against its guess.
    """
    return max(0.0, 1.0 - sum(belief for _, belief in item.beliefs)) / len(classes)


def _classes(informative: Sequence[Evidence]) -> tuple[str, ...]:
    """Return every class of the table, and those that a user's gallery or scene adds."""
    named = [name for item in informative for name, _ in item.beliefs]
    return tuple(dict.fromkeys((*materials.MATERIALS, *named)))


def _heaviest(informative: Sequence[Evidence], material: str) -> Rung:
    """Return the rung that supports the material most, compared with an even spread."""
    classes = _classes(informative)

    def weight(item: Evidence) -> float:
        belief = dict(item.beliefs).get(material, 0.0) + _share(item, classes)
        return _weight(item, informative) * math.log(max(belief, FLOOR) * len(classes))

    return max(informative, key=weight).rung


def _contradicting(before: Fused, newest: Evidence) -> tuple[Evidence, ...]:
    """Return the latest recognitions in a row, with this one, of one material other than fused.

    A run continues even after the mean has changed to its material, because hysteresis may still
    keep the old one.
    """
    if newest.confidence < KNOWN:
        return ()
    run = tuple(item for item in before.contradicting if item.material == newest.material)
    contradicts = bool(run) or newest.material != before.evidence.material
    return (*run, newest) if contradicts else ()


def _running_mean(before: Evidence, newest: Evidence, share: float) -> Evidence:
    beliefs = {name: belief * (1.0 - share) for name, belief in before.beliefs}
    for name, belief in newest.beliefs:
        beliefs[name] = beliefs.get(name, 0.0) + belief * share
    kept = [item for item in beliefs.items() if item[1] >= FLOOR]
    return Evidence(newest.rung, tuple(sorted(kept, key=lambda item: (-item[1], item[0]))))
