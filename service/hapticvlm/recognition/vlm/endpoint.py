"""One HTTP question and its answer, within a time and a size. Knows no model.

The standard library's client, because it follows no redirect and reads no proxy from the
environment: a frame goes where the user said and nowhere else. One deadline holds for the whole
exchange, so that an endpoint which dribbles a byte a second is cut off like one which is silent.
"""

from __future__ import annotations

import http.client
import io
import json
import socket
import ssl
import time
from dataclasses import dataclass, field
from typing import cast

from hapticvlm.recognition.vlm.address import Address
from hapticvlm.recognition.vlm.reply import EndpointError, Json, judge, printable

MOST_BYTES = 1 << 20  # of an answer; one with 20 log-probabilities a token stays below 64 KiB
CONNECT_S = 5.0


@dataclass(frozen=True, slots=True)
class Endpoint:
    """An address and the bearer token sent to it. Deadlines are times of `time.monotonic`, s."""

    address: Address
    token: str | None = field(repr=False)

    def post(self, path: str, body: Json, deadline: float) -> Json:
        """Ask with a JSON body. Raises EndpointError."""
        return self._asked("POST", path, json.dumps(body).encode(), deadline)

    def get(self, path: str, deadline: float) -> Json:
        """Ask without one. Raises EndpointError."""
        return self._asked("GET", path, None, deadline)

    def _asked(self, verb: str, path: str, body: bytes | None, deadline: float) -> Json:
        begun = time.monotonic()
        try:
            return self._exchange(verb, path, body, deadline)
        except TimeoutError:
            took = f"no whole answer within {max(0.0, deadline - begun):.1f} s"
            raise self._error(f"{self.address.name}: {took}") from None
        except EndpointError as error:
            raise self._error(str(error), error) from None
        except (OSError, http.client.HTTPException) as error:
            said = printable(str(error)) or type(error).__name__
            raise self._error(f"{self.address.name}: {said}") from None

    def _exchange(self, verb: str, path: str, body: bytes | None, deadline: float) -> Json:
        with _connect(self.address, deadline) as sock:
            connection = http.client.HTTPConnection(self.address.name)
            connection.sock = cast(socket.socket, _Line(sock, deadline))
            connection.request(verb, self.address.path + path, body, self._headers())
            response = connection.getresponse()
            wait = response.headers.get("Retry-After")
            return judge(response.status, wait, _read(response))

    def _headers(self) -> dict[str, str]:
        headers = {
            "Content-Type": "application/json",
            "Accept": "application/json",
            "Accept-Encoding": "identity",
            "Connection": "close",
        }
        return (
            headers if self.token is None else headers | {"Authorization": f"Bearer {self.token}"}
        )

    def _error(self, text: str, error: EndpointError | None = None) -> EndpointError:
        """Word an error without the token, which an endpoint may have put in its own words."""
        text = text if self.token is None else text.replace(self.token, "(token)")
        if error is None:
            return EndpointError(text)
        return EndpointError(text, error.status, error.wait_s)


class _Line:
    """What http.client calls of a socket, every send and read of it before one deadline."""

    def __init__(self, sock: socket.socket, deadline: float) -> None:
        self._sock, self._deadline = sock, deadline

    def sendall(self, data: bytes) -> None:
        self._sock.settimeout(_left(self._deadline))
        self._sock.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        return io.BufferedReader(_Reader(self._sock, self._deadline))

    def close(self) -> None:
        """Leave the socket to its owner: http.client lets go of it before the body is read."""


class _Reader(io.RawIOBase):
    def __init__(self, sock: socket.socket, deadline: float) -> None:
        self._sock, self._deadline = sock, deadline

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        self._sock.settimeout(_left(self._deadline))
        return self._sock.recv_into(buffer)


def _connect(address: Address, deadline: float) -> socket.socket:
    """Open the connection. Looking up a name takes as long as the system's resolver does."""
    place = (address.host, address.port)
    try:
        sock = socket.create_connection(place, timeout=min(CONNECT_S, _left(deadline)))
    except TimeoutError:
        raise EndpointError(f"{address.name} does not take the connection") from None
    if not address.is_encrypted:
        return sock
    try:
        return ssl.create_default_context().wrap_socket(sock, server_hostname=address.host)
    except BaseException:
        sock.close()
        raise


def _left(deadline: float) -> float:
    left = deadline - time.monotonic()
    if left <= 0:
        raise TimeoutError
    return left


def _read(response: http.client.HTTPResponse) -> bytes:
    """Read a body of at most MOST_BYTES, whole."""
    announced = response.length or 0
    data = b"" if announced > MOST_BYTES else response.read(MOST_BYTES + 1)
    if announced > MOST_BYTES or len(data) > MOST_BYTES:
        raise EndpointError(f"the endpoint's answer is larger than {MOST_BYTES} bytes")
    if response.length:
        raise EndpointError(f"the endpoint's answer ends {response.length} bytes early")
    return data
