"""Several recognitions of one object as one evidence. Pure; knows neither pictures nor objects.

The mean of the beliefs of all recognitions, of which the newest counts 1 / MEMORY at least; when
CHANGE in a row find the same other material, something else is shown and the mean starts anew.
A belief carries its own weight: a poor picture leaves much open. Not taken (`hapticvlm measure
fusion`): short means and moving averages (2 to 6 times the flips for as quick a change), products
with an exponent and a Bayes filter (surer than right: neighbouring frames repeat each other's
errors), the mean embedding (its best guess is no better, and evidence would have to carry it),
weights by size or sharpness (nothing gained).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hapticvlm.evidence import ladder
from hapticvlm.evidence.ladder import FLOOR, KNOWN, Evidence

# Chosen on drifting crops of teaching sources, never on what is held back.
MEMORY = 32  # recognitions; so far back each counts alike, older ones fade
CHANGE = 4  # in a row: fewer flip with a blurred stretch, more delay what is rendered


@dataclass(frozen=True, slots=True)
class Fused:
    """The evidence of all recognitions of one object, their number, and those that contradict."""

    evidence: Evidence
    count: int
    contradicting: tuple[Evidence, ...] = ()


def update(before: Fused | None, newest: Evidence) -> Fused:
    """Fuse one more recognition; bounded by MEMORY, CHANGE and the number of materials."""
    if before is None:
        return Fused(newest, 1)
    contradicting = _contradicting(before, newest)
    if len(contradicting) == CHANGE:
        return Fused(ladder.fuse(contradicting), CHANGE)
    count = min(before.count + 1, MEMORY)
    return Fused(_mean(before.evidence, newest, 1.0 / count), count, contradicting)


def fuse(found: Iterable[Evidence]) -> Evidence:
    """Fuse recognitions in the order of their frames."""
    fused: Fused | None = None
    for evidence in found:
        fused = update(fused, evidence)
    return fused.evidence if fused else Evidence("encoder", ())


def _contradicting(before: Fused, newest: Evidence) -> tuple[Evidence, ...]:
    """Return those in a row, this one included, that find another material than was fused.

    A run goes on when the mean has come over to it, since hysteresis may still hold the old label.
    """
    if newest.confidence < KNOWN:
        return ()
    run = tuple(item for item in before.contradicting if item.material == newest.material)
    contradicts = bool(run) or newest.material != before.evidence.material
    return (*run, newest) if contradicts else ()


def _mean(before: Evidence, newest: Evidence, share: float) -> Evidence:
    beliefs = {name: belief * (1.0 - share) for name, belief in before.beliefs}
    for name, belief in newest.beliefs:
        beliefs[name] = beliefs.get(name, 0.0) + belief * share
    kept = [item for item in beliefs.items() if item[1] >= FLOOR]
    return Evidence(newest.rung, tuple(sorted(kept, key=lambda item: (-item[1], item[0]))))
