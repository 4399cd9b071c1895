"""Lists what a study's figures support as claims about people, and what they do not. Pure.

A claim about people in general needs an interval that assumes independent people, and "better than
chance" needs that interval to lie above chance. A difference between patterns needs a p that is
corrected for all pairs tested. Not to have found a difference is not a finding: the list says how
large a difference this number of people would have found (`smallest_difference`). Simulated devices
and pilots that were only heard support no claim about what people feel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from hapticvlm_studio.evaluation.distributions import root, t_above, t_limit

ALPHA = 0.05
POWER = 0.8
FEW_PEOPLE = 6  # with fewer, an interval depends on its assumptions; our choice
MIN_COMPARED = 3  # people, for a paired test
_MAX_PAIRS = 5

Document = dict[str, Any]


def may(document: Document) -> list[str]:
    """Return what may be claimed of a report's document, a sentence each."""
    return list(_may(document))


def may_not(document: Document) -> list[str]:
    """Return what may not be claimed of a report's document, a sentence each."""
    return list(_may_not(document))


def smallest_difference(people: int, alpha: float = ALPHA) -> float:
    """Return the difference that a paired t-test finds in four studies of five (POWER).

    It is in standard deviations of people's differences, two-sided at the level `alpha`; infinite
    for fewer than two people.
    """
    if people < 2:
        return math.inf
    df = people - 1
    critical = t_limit(1.0 - alpha, df)

    # If the true difference is d standard deviations, t of n people is distributed around d sqrt(n)
    # (noncentral t). The power is the probability that it exceeds the critical value; the root of
    # power - POWER is searched for between no difference and one that is found nearly always. The
    # opposite tail is neglected: at this power, a significant difference of the wrong sign has a
    # probability below 0.2 %.
    def excess_power(effect: float) -> float:
        shift = effect * math.sqrt(people)
        return t_above(critical, df, shift) - POWER

    return root(excess_power, 0.0, (5.0 * critical + 5.0) / math.sqrt(people))


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
            f"patterns on this device (95 % interval by person; observed: "
            f"{_percent(whole['share'])})."
        )
        yield f"They do so better than chance ({chance})."
    yield from _effects(document)


def _effects(document: Document) -> Iterator[str]:
    for effect in document["anova"]:
        p = effect["p_corrected"]
        if p is not None and p < ALPHA:
            yield (
                f"Recognition depends on {effect['name']} ({_p(p)} after Greenhouse and Geisser)."
            )
    if not document["complete"]:
        return
    significant = [pair for pair in document["pairwise"] if pair["p_holm"] < ALPHA]
    for pair in significant[:_MAX_PAIRS]:
        more, less = (pair["first"], pair["second"])[:: 1 if pair["difference"] > 0 else -1]
        yield f"{more} is recognised more often than {less} ({_p(pair['p_holm'])} after Holm)."
    if len(significant) > _MAX_PAIRS:
        yield f"{len(significant) - _MAX_PAIRS} more pairs differ; see the table."


def _may_not(document: Document) -> Iterator[str]:
    if document["simulated"]:
        yield "Anything about people: the devices were simulated and nobody felt anything."
        return
    if document.get("heard"):
        yield "Anything about touch: in this pilot the vibration was heard, not felt."
        return
    yield from _too_few(document)
    yield from _not_equal(document)
    yield (
        "Anything about other devices, levels, patterns or people, or that the vision of the "
        "system recognises materials: people distinguished patterns that were chosen beforehand."
    )
    if document.get("ratings"):
        yield (
            "That a pattern feels as real as its material: ratings compare patterns with each "
            "other, and no real material was felt for comparison."
        )


def _too_few(document: Document) -> Iterator[str]:
    """Yield the claims that need more people or more trials."""
    people = document["participants"]
    whole = document["recognition"]
    if people < 2:
        yield "Anything about people in general: one person took part."
    elif whole["by_person"] is None:
        yield (
            "How much people in general would vary: single people's trials are not known, and an "
            "interval that assumes independent trials is too narrow."
        )
    elif whole["by_person"][0] <= document["chance"]:
        yield "That recognition is better than chance: the interval by person includes chance."
    if 2 <= people < FEW_PEOPLE:
        yield (
            f"Much by {people} people alone: with so few, the interval rests on the assumption of "
            "a normal distribution. More people narrow it; more trials of the same people do not."
        )
    if document["answered"] < document["planned"]:
        yield (
            f"That this is the result: {document['answered']} of {document['planned']} trials are "
            "answered. Repeated looks that stop at a small p find effects that do not exist."
        )


def _not_equal(document: Document) -> Iterator[str]:
    """Yield what it means to find no difference, and which difference would have been found."""
    claim = (
        "That patterns are recognised alike: finding no difference does not show that none exists."
    )
    people = document["complete"] or 0
    pairs = len(document["pairwise"])
    if people < MIN_COMPARED:
        yield claim
        return
    alone, among = (smallest_difference(people, alpha) for alpha in (ALPHA, ALPHA / pairs))
    spread = document["pair_spread"]
    points = "" if not spread else f", here {100 * alone * spread:.0f} percentage points"
    yield (
        f"{claim} With {people} people a paired test finds, in four studies of five, only "
        f"differences of at least {alone:.1f} standard deviations{points}; with {pairs} pairs "
        f"tested together, of at least {among:.1f}."
    )


def _p(p: float) -> str:
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
