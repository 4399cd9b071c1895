"""One kept connection to a shared recogniser: a request and its whole answer before a deadline."""

from __future__ import annotations

import http
import http.client
import json
import socket
import time
from typing import cast

from hapticvlm import http_client as http_line
from hapticvlm.http_client import Address, Line, LineError, printable
from hapticvlm.vision.remote.contract import MAX_ANSWER_BYTES, MESSAGEPACK

# How a peer ends a connection that lay idle: then, and only then, the request is sent once more.
_ENDED = (BrokenPipeError, ConnectionResetError, http.client.RemoteDisconnected)


class Exchange:
    """Opens the connection when it is needed and keeps it. For one thread."""

    def __init__(self, address: Address, token: str | None) -> None:
        self._address = address
        self._token = token
        self._sock: socket.socket | None = None
        self._connection: http.client.HTTPConnection | None = None

    def ask(self, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
        """Return the body of the answer. Raises LineError, whatever goes wrong."""
        begun = time.monotonic()
        try:
            return self._asked(verb, path, body, deadline)
        except TimeoutError:
            text = f"no whole answer within {1000.0 * max(0.0, deadline - begun):.0f} ms"
        except (OSError, http.client.HTTPException, LineError) as error:
            text = printable(str(error)) or type(error).__name__
        self.close()
        raise LineError(text if self._token is None else text.replace(self._token, "(token)"))

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        if self._sock is not None:
            self._sock.close()
        self._sock = self._connection = None

    def _asked(self, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
        if self._sock is not None:
            try:
                return self._exchange(verb, path, body, deadline)
            except _ENDED:
                self.close()
        return self._exchange(verb, path, body, deadline)

    def _exchange(self, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
        connection = self._opened(deadline)
        cast(Line, connection.sock).deadline = deadline
        connection.request(verb, self._address.path + path, body, self._headers())
        response = connection.getresponse()
        data = http_line.read_body(response, MAX_ANSWER_BYTES)
        if response.will_close:
            self.close()
        if response.status != http.HTTPStatus.OK:
            raise LineError(f"it answers HTTP {response.status}: {_reason(data)}")
        return data

    def _opened(self, deadline: float) -> http.client.HTTPConnection:
        if self._connection is None:
            self._sock = http_line.connect(self._address, deadline)
            self._connection = http.client.HTTPConnection(self._address.name)
            self._connection.auto_open = 0
            self._connection.sock = cast(socket.socket, Line(self._sock, deadline))
        return self._connection

    def _headers(self) -> dict[str, str]:
        headers = {"Content-Type": MESSAGEPACK, "Accept-Encoding": "identity"}
        if self._token is not None:
            headers["Authorization"] = f"Bearer {self._token}"
        return headers


def _reason(data: bytes) -> str:
    try:
        text = json.loads(data)["error"]
    except (ValueError, KeyError, TypeError, RecursionError):
        text = data[:400].decode("utf-8", "replace")
    return printable(str(text)) or "no word why"
