"""Serves the file of material overrides to a browser of the service's own machine only.

The file names a scene's objects. Other machines, and other users of this one, have no right to it:
where a token is set, it is needed here, too.
"""

from __future__ import annotations

from collections.abc import Callable

from websockets.http11 import Response

from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.web import http, overrides_file
from hapticvlm.session.overrides import MaterialOverrides

OVERRIDES = "/stated.json"


class LoopbackPages:
    """The material overrides, as `serve --stated` reads them."""

    def __init__(
        self, policy: http.AccessPolicy, overrides: Callable[[], MaterialOverrides]
    ) -> None:
        self._policy = policy
        self._overrides = overrides

    def answer(self, connection: http.Ends, request: HttpRequest) -> Response | None:
        """Answer a request for the file; None: the request is for another page."""
        if request.is_upgrade or request.path != OVERRIDES:
            return None
        refusal = http.refuse(connection, request, self._policy)
        if refusal is None:
            refusal = self._refuse(connection, request)
        if refusal is not None:
            return refusal
        document = overrides_file.text(self._overrides().by_object)
        return http.response(200, document, "application/json")

    def _refuse(self, connection: http.Ends, request: HttpRequest) -> Response | None:
        if not is_loopback(connection.remote_address[0]):
            return http.response(403, "this is shown on the service's own machine only\n")
        token = self._policy.token
        return None if token is None else http.ask_for(token, request)
