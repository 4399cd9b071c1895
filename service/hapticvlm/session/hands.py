"""The hands of one scene: motion, contact and lease of each, and the hold of a stop on outputs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from hapticvlm.messages import LEASE_MS, HandName, Interaction, Region, Scope, Touch
from hapticvlm.rendering.vibration.vibration import TEXTURES, Motion
from hapticvlm.session.targets import (
    WHOLE_VIEW,
    HandRegion,
    ObjectTarget,
    ThingTarget,
    of_object,
)

Output = Literal["speaker", "peltier"]
LEASE_S = LEASE_MS / 1000.0
NAMES: tuple[HandName, ...] = ("left", "right")
OUTPUTS: tuple[Output, ...] = ("speaker", "peltier")
LEAD_WITHIN_S = 0.46  # to contact, from when the plate leads (physics.md 1.3); our choice
LONGEST_LEAD_S = 0.6  # without a contact, then the plate goes back to neutral; our choice
# A full lead that no contact followed was a mistake, and the next one soon after it most likely is
# too: a hand that reaches for cold metal again and again would be cold without ever touching. Only
# one that comes nearer than it ever was leads again at once.
# The pause doubles with each failed lead until a contact; our choice.
RETRY_S = 2.0
LONGEST_RETRY_S = 16.0
# A lead may be in vain: a hand that sways above an object comes and goes at up to 0.1 m/s, and an
# approach without a distance means anything from a reach to a touch. Until the hand closes faster
# than a sway does, the plate moves by so little that the skin cannot be led further than this: the
# skin never changes by more than the plate, whatever the resistance between them. Our choices.
CERTAIN_MPS = 0.1
# A reach that slows down stops by itself (`Slowing`), and touches nothing if it stops further than
# this from the object; our choices.
STOPS_SHORT_M = 0.01
_SLOWING_OVER_S = 0.07  # shorter, and a change of speed is mostly noise
_FEWEST_SPEEDS = 3
LEAD_IN_VAIN_C = 0.3
STILL = Motion(speed_mps=0.0, force_n=0.0)


@dataclass(slots=True)
class Slowing:
    """Predicts where an approach stops by how it slows down; times are the client's.

    Reaches have minimum jerk (Flash and Hogan 1985): at a share s of its time before its end, one
    of length D in T s has the speed 30 D/T s^2 (1 - s)^2, which is sqrt(speed / fastest) = 4 s
    (1 - s), and slows down at 60 D/T^2 s (1 - s)(1 - 2 s). Near its end this leaves 2 v^2 / 3 a.
    """

    fastest_mps: float = 0.0  # of this reach: a pause longer than _SLOWING_OVER_S ends one
    samples: tuple[tuple[float, float], ...] = ()  # time and speed, of the last _SLOWING_OVER_S

    def left_m(self, speed_mps: float, at: float) -> float:
        """Receive a speed; return how much further the hand goes by itself, m; inf: unknown."""
        kept = [sample for sample in self.samples if 0.0 < at - sample[0] <= _SLOWING_OVER_S]
        self.samples = (*kept, (at, speed_mps))
        self.fastest_mps = max(self.fastest_mps if kept else 0.0, speed_mps)
        # A line through the samples tells the speed in the midst of them and how it changes. The
        # way left is counted from there.
        count = len(self.samples)
        mean_at = sum(sample[0] for sample in self.samples) / count
        mean_mps = sum(sample[1] for sample in self.samples) / count
        spread = sum((sample[0] - mean_at) ** 2 for sample in self.samples)
        change = sum((sample[0] - mean_at) * (sample[1] - mean_mps) for sample in self.samples)
        if count < _FEWEST_SPEEDS or not 0.0 < mean_mps < self.fastest_mps or not change < 0.0:
            return math.inf
        slows = -change / spread
        s = 0.5 - 0.5 * math.sqrt(1.0 - math.sqrt(mean_mps / self.fastest_mps))
        shape = (10.0 - 15.0 * s + 6.0 * s * s) * (1.0 - 2.0 * s) / (15.0 * (1.0 - s) ** 3)
        return shape * mean_mps**2 / slows - mean_mps * (at - mean_at)


@dataclass(slots=True)
class Hand:
    """One hand; no lease means it touches nothing."""

    number: int
    lease_until: float | None = None
    contact_at: float | None = None
    target: ThingTarget = WHOLE_VIEW
    region: Region | None = None
    interaction: Interaction | None = None
    motion: Motion = STILL
    is_sliding: bool = False
    near_since: float | None = None
    is_certain: bool = False  # that the lead ends in a contact, by the speed of the approach
    nearest_m: float | None = None  # of the newest lead; None where the client sends no distance
    slowing: Slowing = field(default_factory=Slowing)
    failed_leads: int = 0  # full leads that ended without a contact, since the last contact
    last_failed_at: float = -math.inf  # when the last of them ended

    @property
    def name(self) -> HandName:
        """Left or right, as on the wire."""
        return NAMES[self.number]

    @property
    def is_active(self) -> bool:
        """Whether this hand holds a lease."""
        return self.lease_until is not None

    @property
    def is_touching(self) -> bool:
        """Whether this hand is in contact."""
        return self.contact_at is not None

    @property
    def interaction_name(self) -> str:
        """The interaction: as the client names it, else strike, and slide once the hand slides."""
        if self.is_sliding and self.interaction not in TEXTURES:
            return "slide"
        return self.interaction or "strike"

    @property
    def vibrates(self) -> bool:
        """Whether this hand vibrates: in contact, or swinging."""
        return self.is_touching or self.interaction == "swing"

    def lead_limit_c(self, now: float) -> float:
        """Return how far the plate may lead this approach, degC from neutral.

        It leads while contact is near and not long awaited: 0 before and after. Without a certain
        contact it is LEAD_IN_VAIN_C, with one inf.
        """
        if self.near_since is None or not 0.0 <= now - self.near_since <= LONGEST_LEAD_S:
            return 0.0
        return math.inf if self.is_certain else LEAD_IN_VAIN_C

    def update(self, touch: Touch, now: float) -> bool:
        """Receive a touch other than a release; return whether it is an onset."""
        begins = self.contact_at is None
        self._approach(touch, now)
        self.lease_until = now + LEASE_S
        self.target = self._target_of(touch)
        self.region = touch.region
        self.motion = Motion(touch.speed_mps, touch.force_n)
        self.interaction = touch.interaction
        if touch.phase == "approach":
            self.contact_at = None
            self.is_sliding = touch.interaction == "swing"
            return False
        if begins:
            self.contact_at = now
        onset = begins and touch.phase == "contact"
        named = touch.interaction
        self.is_sliding = touch.phase == "slide" or named in TEXTURES or not (onset or named)
        return onset

    def _approach(self, touch: Touch, now: float) -> None:
        """Note since when a contact with this object has been near."""
        if touch.phase != "approach":
            self.near_since = self.nearest_m = None
            self.failed_leads = 0
            self.last_failed_at = -math.inf
            self.slowing = Slowing()
            return
        if not _is_near(touch) or self._stops_short(touch):
            self._end_lead(now)
            return
        is_other = (self._target_of(touch), touch.region) != (self.target, self.region)
        if self.near_since is None or is_other:
            self._begin_lead(touch, now)
        elif touch.distance_m is not None and self.nearest_m is not None:
            self.nearest_m = min(self.nearest_m, touch.distance_m)
        if self.near_since is not None and not self.is_certain and _is_certain(touch):
            self.near_since = now  # the full lead has its whole time, however long it was capped
            self.is_certain = True

    def _stops_short(self, touch: Touch) -> bool:
        """Whether the hand slows down so much that it will stop before the object."""
        if touch.distance_m is None or touch.closing_mps is None:
            return False
        left_m = self.slowing.left_m(touch.closing_mps, touch.captured_at)
        return touch.distance_m > left_m + STOPS_SHORT_M

    def _begin_lead(self, touch: Touch, now: float) -> None:
        distance_m = touch.distance_m
        before_m = self.nearest_m
        comes_nearer = distance_m is not None and before_m is not None and distance_m < before_m
        retry_after_s = min(RETRY_S * 2.0 ** (self.failed_leads - 1), LONGEST_RETRY_S)
        if now - self.last_failed_at < retry_after_s and not comes_nearer:
            return
        self.near_since = now
        self.is_certain = False
        self.nearest_m = distance_m

    def _end_lead(self, now: float) -> None:
        """End the lead; note a full one, which ended without a contact."""
        if self.near_since is not None and self.is_certain:
            self.failed_leads += 1
            self.last_failed_at = min(now, self.near_since + LONGEST_LEAD_S)
        self.near_since = None

    def _target_of(self, touch: Touch) -> ThingTarget:
        """Return what this touch is on: the object it names, else the region it names."""
        if touch.object_id is None and touch.region is not None:
            return HandRegion(self.name)
        kept = self.target
        if (
            isinstance(kept, ObjectTarget)
            and kept.object_id == touch.object_id
            and kept.surface == touch.surface
        ):
            return kept  # a renewal makes no new objects
        return of_object(touch.object_id, touch.surface)

    def release(self, now: float | None = None) -> None:
        """End the lease and the contact; with `now` a lead that failed is remembered."""
        if now is not None:
            self._end_lead(now)
        self.near_since = None
        self.lease_until = self.contact_at = None
        self.target = WHOLE_VIEW
        self.region = None
        self.interaction = None
        self.is_sliding = False
        self.motion = STILL


def _is_near(touch: Touch) -> bool:
    """Whether an approach touches within LEAD_WITHIN_S; one that gives no distance may."""
    if touch.distance_m is None or touch.closing_mps is None:
        return True
    return touch.distance_m <= max(touch.closing_mps, 0.0) * LEAD_WITHIN_S


def _is_certain(touch: Touch) -> bool:
    """Whether a near approach closes too fast to be the sway of a hand that hovers."""
    return touch.distance_m is not None and (touch.closing_mps or 0.0) > CERTAIN_MPS


class Hands:
    """Both hands of one scene."""

    def __init__(self) -> None:
        self._hands = {name: Hand(number) for number, name in enumerate(NAMES)}

    def __getitem__(self, name: HandName) -> Hand:
        """Return the left or the right hand."""
        return self._hands[name]

    def __iter__(self) -> Iterator[Hand]:
        """Go through both hands, the left one first."""
        return iter(self._hands.values())

    @property
    def leases(self) -> int:
        """Number of hands that hold a lease."""
        return sum(hand.is_active for hand in self)

    @property
    def on_plate(self) -> Hand | None:
        """The hand of the latest contact; without one, a hand that approaches."""
        touching = [hand for hand in self if hand.is_touching]
        if touching:
            return max(touching, key=lambda hand: hand.contact_at or 0.0)
        return next((hand for hand in self if hand.is_active), None)

    def interaction_on(self, target: ThingTarget) -> str | None:
        """Return how this is touched, if it is."""
        touching = (hand for hand in self if hand.is_active and hand.target == target)
        return next((hand.interaction_name for hand in touching), None)

    def lapse(self, now: float) -> list[Hand]:
        """End the leases that were not renewed; return whose they were."""
        late = [hand for hand in self if hand.lease_until is not None and hand.lease_until < now]
        for hand in late:
            hand.release(now)
        return late

    def release(self) -> None:
        """End every lease."""
        for hand in self:
            hand.release()


class Hold:
    """Outputs at rest after a stop, for each hand until its release and then a new touch.

    Shared by all sessions of a service, so that a scene that reconnects does not undo a stop.
    """

    def __init__(self) -> None:
        self._held: dict[tuple[Output, HandName], bool] = {}

    def stop(self, scope: Scope) -> None:
        """Hold the outputs of this scope for both hands."""
        outputs = OUTPUTS if scope == "all" else (scope,)
        self._held |= {(output, hand): False for output in outputs for hand in NAMES}

    @property
    def state(self) -> tuple[tuple[Output, HandName, bool], ...]:
        """Everything that is held: output, hand, and whether a release has armed it."""
        return tuple((output, hand, armed) for (output, hand), armed in self._held.items())

    def restore(self, state: Iterable[tuple[Output, HandName, bool]]) -> None:
        """Hold just this, as a record of another time has it."""
        self._held = {(output, hand): armed for output, hand, armed in state}

    def update(self, touch: Touch) -> None:
        """Receive a touch of the owner: release arms its hand, a new approach or contact lifts."""
        if not self._held:
            return
        for (output, hand), armed in tuple(self._held.items()):
            if hand != touch.hand:
                continue
            if touch.phase == "release":
                self._held[output, hand] = True
            elif armed and touch.phase in ("approach", "contact"):
                del self._held[output, hand]

    def holds(self, output: Output, hand: HandName | None) -> bool:
        """Whether this output must rest for this hand; None = for either."""
        if not self._held:
            return False
        hands = NAMES if hand is None else (hand,)
        return any((output, name) in self._held for name in hands)

    def holds_all(self, hand: HandName) -> bool:
        """Whether nothing may move for this hand."""
        return bool(self._held) and self.outputs(hand) == OUTPUTS

    def outputs(self, hand: HandName) -> tuple[Output, ...]:
        """Name the outputs that must rest for this hand."""
        return tuple(output for output in OUTPUTS if (output, hand) in self._held)
