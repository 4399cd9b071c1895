"""Assigns the outputs to one scene at a time and notifies the others.

The first scene owns them until it closes, and again the first that asks once they are free. Outputs
whose owner has held no lease for IDLE_OWNER_S go to the scene that asks. Every change rests them.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Sequence

from hapticvlm.messages import Error, MessageError, Ownership, Set
from hapticvlm.server.connection import Connection
from hapticvlm.server.counters import Count
from hapticvlm.server.outputs import Outputs
from hapticvlm.server.vibration_events import VibrationEvents

IDLE_OWNER_S = 30.0  # without a lease, before another scene may take the outputs
PATH = "$.ownership"

logger = logging.getLogger(__name__)


class OutputOwnership:
    """The owner of the outputs among the connections of one gateway."""

    def __init__(
        self,
        outputs: Outputs,
        vibration: VibrationEvents,
        connections: Sequence[Connection],
        counts: Counter[Count],
    ) -> None:
        self.owner: Connection | None = None
        self.leased_at = time.monotonic()
        self._outputs = outputs
        self._vibration = vibration
        self._connections = connections
        self._counts = counts

    def join(self, connection: Connection) -> None:
        """Make the scene the owner that was admitted as such."""
        if connection.session.owner:
            self.owner = connection
            self.leased_at = time.monotonic()
            self._notify(but=connection)

    def leave(self, connection: Connection) -> None:
        """Free the outputs when it was their owner that left."""
        if self.owner is connection:
            self._free()

    def free_if_owner_closes(self) -> None:
        """Free the outputs of an owner whose closing handshake has begun.

        A scene that closes and connects again at once, as at a change of scene, finds them free:
        its old connection is still being taken apart then, and what arrived on it drives nothing.
        """
        # A closing handshake takes a round trip, and a scene that reloads connects within it.
        # Waiting for the old connection to be gone would make it a second scene for that moment,
        # which owns nothing and feels nothing until its user finds out why.
        if self.owner is not None and not self.owner.is_open:
            self._give(self.owner)

    def change(self, requester: Connection, wanted: Set, now: float) -> None:
        """Assign the outputs as a client asks. Raises MessageError."""
        match wanted.ownership:
            case "end":
                self._end(requester, wanted)
            case "give":
                self._give(requester)
            case _:
                self._take(requester, wanted, now)

    def _end(self, requester: Connection, wanted: Set) -> None:
        """Close the owner's connection, whoever asks."""
        if self.owner is None:
            raise MessageError("message", "nobody owns the outputs", path=PATH, id=wanted.id)
        logger.warning("%s ended by %s", self.owner.name, requester.name)
        self._counts[Count.OWNERS_ENDED] += 1
        self._outputs.rest()
        self.owner.end("ended by an observer")

    def _give(self, requester: Connection) -> None:
        """Free the outputs if they are the requester's; it has given them up in any case."""
        if self.owner is requester:
            requester.session.set_owner(owner=False)
            requester.session.rest()
            self._free()

    def _take(self, requester: Connection, wanted: Set, now: float) -> None:
        """Assign the outputs to a scene, if nobody owns them or their owner is idle."""
        if requester.session.observer:
            text = "an observer owns no outputs: connect as scene"
            raise MessageError("not_owner", text, path=PATH, id=wanted.id)
        if self.owner is not None and self.owner is not requester:
            self._transfer_from(self.owner, wanted, now)
            self._vibration.rest()
            self._vibration.end()
        self.owner = requester
        # Taking counts as a lease. Otherwise the next scene could take the outputs from one that
        # has them since a moment and has touched nothing yet.
        self.leased_at = now
        requester.session.set_owner(owner=True, thermal_gain=self._outputs.thermal_gain)
        self._notify(but=requester)

    def _transfer_from(self, owner: Connection, wanted: Set, now: float) -> None:
        """Take the outputs from an owner that touches nothing. Raises MessageError."""
        idle_s = now - self.leased_at
        if idle_s < IDLE_OWNER_S:
            text = (
                f"{owner.name} owns the outputs and touched something {idle_s:.0f} s ago: "
                f"wait until {IDLE_OWNER_S:.0f} s have passed, or end it from the dashboard"
            )
            raise MessageError("not_owner", text, path=PATH, id=wanted.id)
        # In this order: the session first, so that nothing it still does reaches the outputs; then
        # the outputs, which rest as at a stop; then the message. The new owner begins with a plate
        # on its way to neutral and a speaker that fades, and must touch again to drive them.
        owner.session.set_owner(owner=False)
        owner.session.rest()
        self._outputs.rest()
        self._counts[Count.OWNERS_REPLACED] += 1
        text = f"another scene took the outputs: nothing was touched for {idle_s:.0f} s"
        owner.post(Error(id=0, code="not_owner", text=text))

    def _free(self) -> None:
        """Rest the outputs, which nobody owns from now on, and offer them to the scenes."""
        self.owner = None
        self._outputs.rest()
        self._vibration.end()
        self._notify()

    def _notify(self, but: Connection | None = None) -> None:
        """Notify every scene of whose the outputs are, but the one that is answered anyway."""
        is_free = self.owner is None
        for connection in self._connections:
            if connection is not but and not connection.session.observer:
                is_owner = connection is self.owner
                connection.post(Ownership(id=0, owner=is_owner, free=is_free))
