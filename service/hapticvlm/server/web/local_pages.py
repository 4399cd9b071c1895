"""What is served to a browser of the service's own machine only, for the token where one is set.

Recorded sessions show what somebody saw and did, and statements name a scene's objects: other
machines, and other users of this one, have no right to them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from urllib.parse import unquote, urlsplit

from websockets.http11 import Request, Response

from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.web import http, stated_materials
from hapticvlm.server.web.recorded_sessions import RecordedSessions

SESSIONS = "/sessions"
STATED = "/stated.json"


class LoopbackPages:
    """Recorded sessions, if there are any, and the materials that a person stated."""

    def __init__(
        self,
        policy: http.AccessPolicy,
        sessions: RecordedSessions | None,
        stated: Callable[[], Mapping[str, str]],
    ) -> None:
        self._policy = policy
        self._sessions = sessions
        self._stated = stated

    async def answer(self, connection: http.Ends, request: Request) -> Response | None:
        """Answer a request for one of them; None: it is for something else."""
        path = urlsplit(request.path).path
        of_sessions = (path + "/").startswith(SESSIONS + "/")
        if http.is_upgrade(request) or not (of_sessions or path == STATED):
            return None
        refused = http.refuse(connection, request, self._policy)
        if refused is None:
            refused = self._refuse(connection, request)
        if refused is not None:
            return refused
        if not of_sessions:
            return http.response(200, stated_materials.text(self._stated()), "application/json")
        if self._sessions is None:
            return http.response(404, "no session is recorded: see `hapticvlm record`\n")
        name = unquote(path.removeprefix(SESSIONS).removeprefix("/"))
        return await self._sessions.answer(name)

    def _refuse(self, connection: http.Ends, request: Request) -> Response | None:
        if not is_loopback(connection.remote_address[0]):
            return http.response(403, "this is shown on the service's own machine only\n")
        token = self._policy.token
        return None if token is None else http.ask_for(token, request.headers)
