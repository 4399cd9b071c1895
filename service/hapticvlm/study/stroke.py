"""What a hand does to present a pattern, from its approach to its last contact. Pure.

It approaches, rests on the object without rubbing until the plate has brought heat or cold to the
palm, lifts for a moment and strokes. That lift, and those between strokes, are brief enough for the
plate to take all of it as one contact, so repeated strokes are as warm as a single one. Within a
stroke the hand rubs, carves or swings to and fro as rendering/movement.py has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hapticvlm.rendering.interactions import Motion
from hapticvlm.rendering.movement import motion_at
from hapticvlm.rendering.thermal import LEAD_S
from hapticvlm.study.stimuli import Stimulus

LIFT_S = 0.06  # of the hand before a stroke
_STILL = Motion(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Part:
    """What the hand does for so long; only in contact it moves."""

    phase: Literal["approach", "slide", "contact"]
    seconds: float

    @property
    def is_still(self) -> bool:
        """Whether the hand does not stroke."""
        return self.phase != "contact"


def parts(stimulus: Stimulus) -> tuple[Part, ...]:
    """List what the hand does in order; all before the first contact takes `lead_s`."""
    rest_s = stimulus.lead_s - LEAD_S - LIFT_S
    lead: tuple[Part, ...] = (Part("approach", stimulus.lead_s),)
    if rest_s > 0.0:
        lead = (Part("approach", LEAD_S), Part("slide", rest_s), Part("approach", LIFT_S))
    each_s = stimulus.seconds / stimulus.repeats
    again = (Part("contact", each_s - LIFT_S), Part("approach", LIFT_S))
    return (*lead, *again * (stimulus.repeats - 1), Part("contact", each_s))


def motion(stimulus: Stimulus, part: Part, elapsed_s: float) -> Motion:
    """Return how the hand moves so long after this part began."""
    if part.is_still:
        return _STILL
    peak = Motion(stimulus.speed_mps, stimulus.force_n)
    return motion_at(stimulus.interaction, peak, elapsed_s)
