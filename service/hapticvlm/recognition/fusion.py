"""Several looks at one object as one evidence. Pure; knows neither pictures nor objects.

The mean of the beliefs of all looks, of which the newest counts 1 / MEMORY at least; when CHANGE
looks in a row know the same other material, something else is shown and the mean starts anew.
A belief carries its own weight: a poor picture leaves much open. Not taken (`hapticvlm measure
fusion`): short means and moving averages (2 to 6 times the flips for as quick a change), products
with an exponent and a Bayes filter (surer than right: neighbouring frames repeat each other's
errors), the mean embedding (its best guess is no better, and evidence would have to carry it),
weights by size or sharpness (nothing gained).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hapticvlm.recognition import ladder
from hapticvlm.recognition.ladder import FLOOR, KNOWN, Evidence

# Chosen on drifting crops of teaching sources, never on what is held back.
MEMORY = 32  # looks; so far back each counts alike, older ones fade
CHANGE = 4  # looks in a row: fewer flip with a blurred stretch, more delay what is felt


@dataclass(frozen=True, slots=True)
class Fused:
    """What the looks at one object came to: their evidence, how many, and those that object."""

    evidence: Evidence
    looks: int
    objections: tuple[Evidence, ...] = ()


def take_in(before: Fused | None, look: Evidence) -> Fused:
    """Fuse one more look; bounded by MEMORY, CHANGE and the number of materials."""
    if before is None:
        return Fused(look, 1)
    objections = _objections(before, look)
    if len(objections) == CHANGE:
        return Fused(ladder.fuse(objections), CHANGE)
    looks = min(before.looks + 1, MEMORY)
    return Fused(_mean(before.evidence, look, 1.0 / looks), looks, objections)


def fuse(looks: Iterable[Evidence]) -> Evidence:
    """Fuse looks in the order they were taken."""
    fused: Fused | None = None
    for look in looks:
        fused = take_in(fused, look)
    return fused.evidence if fused else Evidence("encoder", ())


def _objections(before: Fused, look: Evidence) -> tuple[Evidence, ...]:
    """Return the looks in a row, this one included, that know another material than was fused.

    A run goes on when the mean has come over to it, since hysteresis may still hold the old label.
    """
    if look.confidence < KNOWN:
        return ()
    run = tuple(one for one in before.objections if one.material == look.material)
    objects = bool(run) or look.material != before.evidence.material
    return (*run, look) if objects else ()


def _mean(before: Evidence, look: Evidence, share: float) -> Evidence:
    beliefs = {name: belief * (1.0 - share) for name, belief in before.beliefs}
    for name, belief in look.beliefs:
        beliefs[name] = beliefs.get(name, 0.0) + belief * share
    kept = [item for item in beliefs.items() if item[1] >= FLOOR]
    return Evidence(look.rung, tuple(sorted(kept, key=lambda item: (-item[1], item[0]))))
