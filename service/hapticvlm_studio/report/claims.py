"""What a study's figures allow to claim of people, and what they do not. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from scipy.optimize import brentq
from scipy.stats import nct, t

ALPHA = 0.05
POWER = 0.8
FEW_PEOPLE = 6
FEWEST_COMPARED = 3
_PAIRS_NAMED = 5

Document = dict[str, Any]


def may(document: Document) -> list[str]:
    """List what may be claimed."""
    return list(_may(document))


def may_not(document: Document) -> list[str]:
    """List what may not be claimed."""
    return list(_may_not(document))


def smallest_difference(people: int, alpha: float = ALPHA) -> float:
    """Return the difference that a paired t-test of so many people finds with the power POWER.

    In standard deviations of the difference between people, two-sided; infinite below two people.
    Numbers from the noncentral t distribution, as any power table has them.
    """
    if people < 2:
        return math.inf
    df = people - 1
    critical = float(t.ppf(1.0 - alpha / 2.0, df))

    def lacking(effect: float) -> float:
        shift = effect * math.sqrt(people)
        return float(nct.sf(critical, df, shift)) - POWER

    return float(brentq(lacking, 0.0, (5.0 * critical + 5.0) / math.sqrt(people)))


def _may(document: Document) -> Iterator[str]:
    if document["simulated"] or document.get("heard"):
        yield "That the study runs: its page, its orders and this report."
        return
    whole = document["recognition"]
    people = document["participants"]
    chance = _percent(document["chance"])
    if whole["by_person"] is None or whole["by_person"][0] <= document["chance"]:
        who = "This one person" if people == 1 else f"These {people} people together"
        yield (
            f"{who} recognised {_percent(whole['share'])} of {whole['of']} trials; chance is "
            f"{chance}."
        )
    else:
        low, high = whole["by_person"]
        yield (
            f"People like these {people} recognise {_percent(low)} to {_percent(high)} of these "
            f"patterns on this device (95 % interval by person; seen: {_percent(whole['share'])})."
        )
        yield f"They do so better than chance ({chance})."
    yield from _effects(document)


def _effects(document: Document) -> Iterator[str]:
    for effect in document["anova"]:
        p = effect["p_corrected"]
        if p is not None and p < ALPHA:
            yield (
                f"How well is recognised depends on {effect['name']} "
                f"({_p(p)} after Greenhouse and Geisser)."
            )
    if not document["complete"]:
        return
    significant = [pair for pair in document["pairwise"] if pair["p_holm"] < ALPHA]
    for pair in significant[:_PAIRS_NAMED]:
        more, less = (pair["first"], pair["second"])[:: 1 if pair["difference"] > 0 else -1]
        yield f"{more} is recognised more often than {less} ({_p(pair['p_holm'])} after Holm)."
    if len(significant) > _PAIRS_NAMED:
        yield f"{len(significant) - _PAIRS_NAMED} more pairs differ; they stand in the table."


def _may_not(document: Document) -> Iterator[str]:
    if document["simulated"]:
        yield "Anything about people: the devices were simulated and nobody felt anything."
        return
    if document.get("heard"):
        yield "Anything about touch: in this pilot the vibration was heard and not felt."
        return
    yield from _too_few(document)
    yield from _not_equal(document)
    yield (
        "Anything about other devices, levels, patterns or people, or that the vision of the "
        "system recognises materials: people told patterns apart that were chosen beforehand."
    )
    if document.get("ratings"):
        yield (
            "That a pattern is as real as its material: ratings compare patterns with each other; "
            "no real material was felt beside them."
        )


def _too_few(document: Document) -> Iterator[str]:
    """Yield what more people or trials would be needed for."""
    people = document["participants"]
    whole = document["recognition"]
    if people < 2:
        yield "Anything about people in general: one person took part."
    elif whole["by_person"] is None:
        yield (
            "How much people in general would vary: single people's trials are not known, and an "
            "interval that takes trials for independent is too narrow."
        )
    elif whole["by_person"][0] <= document["chance"]:
        yield "That it is better than chance: the interval by person reaches down to it."
    if 2 <= people < FEW_PEOPLE:
        yield (
            f"Much by {people} people alone: an interval of so few rests on the assumption that "
            "people scatter evenly. More people narrow it, more trials of the same people do not."
        )
    if document["answered"] < document["planned"]:
        yield (
            f"That this is the result: {document['answered']} of {document['planned']} trials are "
            "answered. Who looks again and again and ends at a small p finds what is not there."
        )


def _not_equal(document: Document) -> Iterator[str]:
    """Yield what finding no difference means, and how large one had to be to be found."""
    text = "That patterns are recognised alike: to find no difference is not to show that none is."
    people = document["complete"] or 0
    pairs = len(document["pairwise"])
    if people < FEWEST_COMPARED:
        yield text
        return
    alone, among = (smallest_difference(people, alpha) for alpha in (ALPHA, ALPHA / pairs))
    spread = document["pair_spread"]
    points = "" if not spread else f", here {100 * alone * spread:.0f} percentage points"
    yield (
        f"{text} With {people} people a paired test finds, in four studies of five, only "
        f"differences of {alone:.1f} standard deviations and more{points}; of {pairs} pairs "
        f"tested together, of {among:.1f}."
    )


def _p(p: float) -> str:
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
