"""The hands of one scene: what each does, its lease, and the hold a stop puts on the outputs."""

from __future__ import annotations

from dataclasses import dataclass, field

from hapticvlm.messages import LEASE_MS, Interaction, Region, Scope, Touch
from hapticvlm.rendering.vibration import Stroke

LEASE_S = LEASE_MS / 1000.0
STILL = Stroke(speed_mps=0.0, force_n=0.0)


@dataclass(slots=True)
class Hand:
    """One hand; no lease means it touches nothing."""

    number: int
    lease_until: float | None = None
    contact_at: float | None = None
    key: str | None = None
    region: Region | None = None
    interaction: Interaction | None = None
    stroke: Stroke = STILL

    @property
    def is_active(self) -> bool:
        """Whether this hand holds a lease."""
        return self.lease_until is not None

    @property
    def is_touching(self) -> bool:
        """Whether this hand is in contact."""
        return self.lease_until is not None and self.contact_at is not None

    def follow(self, touch: Touch, now: float) -> bool:
        """Take in a touch that is no release; return whether it is an onset."""
        lapsed = not self.is_touching
        self.lease_until = now + LEASE_S
        self.key, self.region = touch.object_id, touch.region
        self.stroke = Stroke(touch.speed_mps, touch.force_n)
        self.interaction = touch.interaction
        if touch.phase == "approach":
            self.contact_at = None
            return False
        if lapsed:
            self.contact_at = now
        return lapsed and touch.phase == "contact"

    def let_go(self) -> None:
        """End the lease and the contact."""
        self.lease_until = self.contact_at = None
        self.key = self.region = self.interaction = None
        self.stroke = STILL


@dataclass(slots=True)
class Hold:
    """Scopes at rest after a stop, until a release and then a new approach or contact.

    Shared by all sessions of a service, so that a scene that reconnects does not undo a stop.
    """

    _held: dict[str, bool] = field(default_factory=dict)

    def stop(self, scope: Scope) -> None:
        """Hold this scope."""
        for output in ("speaker", "peltier") if scope == "all" else (scope,):
            self._held[output] = False

    def follow(self, touch: Touch) -> None:
        """Take in a touch of the owner: release arms, a new approach or contact lifts."""
        if touch.phase == "release":
            self._held = dict.fromkeys(self._held, True)
        elif touch.phase in ("approach", "contact"):
            self._held = {output: armed for output, armed in self._held.items() if not armed}

    def holds(self, output: str) -> bool:
        """Tell whether this output must stay at rest."""
        return output in self._held

    @property
    def holds_all(self) -> bool:
        """Whether nothing may move."""
        return len(self._held) == 2
