"""Who finds a place when many have come, and who makes room. A stop needs none."""

from __future__ import annotations

from hapticvlm.messages import Hello, MessageError
from hapticvlm.server.budgets import LOOPBACK_PLACES, MAX_CONNECTIONS, MAX_SCENES
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.web.http import is_loopback

CLOSE_MADE_ROOM = 4002
NO_PLACE = f"{MAX_CONNECTIONS} connections are open already: close one"


class Places:
    """The places of one gateway."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway

    def find(self, hello: Hello, peer: str) -> bool:
        """Return whether a newcomer has a place. Raises MessageError for a scene that has none.

        An observer without a place is let in all the same: a person may have sent it to stop the
        outputs, which nobody may be kept from.
        """
        if hello.role == "scene":
            self._check_scenes(hello)
        if self._has_place(hello, peer):
            return True
        self._gateway.counts["refused: no place"] += 1
        if hello.role == "scene":
            raise MessageError("protocol", NO_PLACE, id=hello.id)
        return False

    def _check_scenes(self, hello: Hello) -> None:
        scenes = sum(not each.session.observer for each in self._gateway.connections)
        if scenes >= MAX_SCENES:
            self._gateway.counts["refused: no place"] += 1
            text = f"{MAX_SCENES} scenes are connected already: close one, or connect as observer"
            raise MessageError("protocol", text, path="$.role", id=hello.id)

    def _has_place(self, hello: Hello, peer: str) -> bool:
        """Whether a place is free, or the oldest of the idle observers makes room.

        The last places are for observers on this machine, so that a crowd locks no dashboard out.
        """
        is_kept_for = hello.role == "observer" and is_loopback(peer)
        places = MAX_CONNECTIONS if is_kept_for else MAX_CONNECTIONS - LOOPBACK_PLACES
        taken = [each for each in self._gateway.connections if each.is_open]
        if len(taken) < places:
            return True
        idle = next((each for each in taken if each.is_idle), None)
        if idle is None:
            return False
        self._gateway.counts["closed: made room"] += 1
        idle.end("made room for another client", CLOSE_MADE_ROOM)
        return True
