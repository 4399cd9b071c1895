"""A stability curve, and the severity at which half of its lead over chance is lost. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

CHANCE = 0.25  # of four classes
LEAD = 0.05  # over chance below which there is nothing to lose


@dataclass(frozen=True, slots=True)
class Step:
    """One severity: balanced accuracy among four with its interval; shares of pictures.

    flips: answers that differ from the clean picture's. wrong_and_sure: named with confidence, and
    wrong. unknown: not named. enrolled: accuracy with the other objects' clean views as references.
    """

    severity: float
    accuracy: float
    low: float
    high: float
    flips: float
    wrong_and_sure: float
    unknown: float
    enrolled: float
    enrolled_flips: float


@dataclass(frozen=True, slots=True)
class Curve:
    """A perturbation's steps, clean first; n pictures."""

    name: str
    unit: str
    n: int
    steps: tuple[Step, ...]

    def breaks_at(self, *, enrolled: bool = False) -> float | None:
        """Severity at which half of the lead over chance is lost; None where it never is."""
        lead = [(step.enrolled if enrolled else step.accuracy) - CHANCE for step in self.steps]
        if lead[0] < LEAD:
            return None
        half = lead[0] / 2
        for (before, after), (low, high) in zip(pairwise(lead), pairwise(self.steps), strict=True):
            if after <= half:
                share = (before - half) / (before - after)
                return low.severity + share * (high.severity - low.severity)
        return None


def sentence(curve: Curve) -> str:
    """Return where a curve breaks, zero-shot and enrolled."""
    worst = curve.steps[-1]
    sure = max(step.wrong_and_sure for step in curve.steps)
    return (
        f"{curve.name}: zero-shot {_loss(curve, enrolled=False)}; "
        f"enrolled {_loss(curve, enrolled=True)}; flips {worst.flips:.0%} at {worst.severity:g}; "
        f"wrong and sure at most {sure:.0%} (n = {curve.n}, {curve.unit})"
    )


def _loss(curve: Curve, *, enrolled: bool) -> str:
    first = curve.steps[0].enrolled if enrolled else curve.steps[0].accuracy
    if first - CHANCE < LEAD:
        return f"has no lead to lose ({first:.0%} clean)"
    at = curve.breaks_at(enrolled=enrolled)
    if at is None:
        return f"keeps half its lead to {curve.steps[-1].severity:g} ({first:.0%} clean)"
    return f"loses half its lead at {at:.2g} ({first:.0%} clean)"
