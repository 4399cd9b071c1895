"""One HTTP question to an endpoint and its answer, within a time and a size. Knows no model.

The standard library's client, because it follows no redirect and reads no proxy from the
environment: a frame goes where the user said and nowhere else. One deadline holds for the whole
exchange, so that an endpoint which dribbles a byte a second is cut off like one which is silent.

Plain http is taken as far as the user's own url says so: pictures then travel in clear text. A
token does not, except to this machine.
"""

from __future__ import annotations

import http
import http.client
import io
import ipaddress
import json
import math
import socket
import ssl
import string
import time
from dataclasses import dataclass, field
from typing import Any, cast
from urllib.parse import urlsplit

from hapticvlm.recognition.vlm.answers import VlmError

MOST_TEXT = 200  # characters of an endpoint's own words that an error repeats

Json = dict[str, Any]

PORTS = {"http": 80, "https": 443}

MOST_BYTES = 1 << 20  # of an answer; one with 20 log-probabilities a token stays below 64 KiB
CONNECT_S = 5.0


class EndpointError(VlmError):
    """The endpoint gave no answer of use. `status` is its HTTP status, `wait_s` its Retry-After."""

    def __init__(self, text: str, status: int | None = None, wait_s: float | None = None) -> None:
        super().__init__(text)
        self.status, self.wait_s = status, wait_s


def judge(status: int, retry_after: str | None, data: bytes) -> Json:
    """Take the JSON object out of a reply. Raises EndpointError."""
    if 300 <= status < 400:
        raise EndpointError(f"the endpoint redirects (HTTP {status}): name its goal", status)
    if status != http.HTTPStatus.OK:
        text = f"the endpoint answers HTTP {status}: {_own_words(data) or 'no word why'}"
        raise EndpointError(text, status, _wait_s(retry_after))
    try:
        answer = json.loads(data, parse_constant=_refuse)
    except (ValueError, RecursionError):
        text = f"the endpoint's answer is no JSON: {_decoded(data)}"
        raise EndpointError(text, status) from None
    if not isinstance(answer, dict):
        raise EndpointError("the endpoint's answer is JSON, but no object", status)
    if answer.get("error"):
        raise EndpointError(f"the endpoint says: {_own_words(data)}", status)
    return answer


def printable(text: str) -> str:
    """Cut foreign words short and drop what could forge a line of a log."""
    clean = "".join(c if c.isprintable() else " " for c in text[: 4 * MOST_TEXT])
    clean = " ".join(clean.split())
    return clean if len(clean) <= MOST_TEXT else clean[:MOST_TEXT] + "..."


def _own_words(data: bytes) -> str:
    """Find the message of an error body, as OpenAI's and FastAPI's endpoints spell it."""
    try:
        found = json.loads(data)
        said = found.get("error") or found.get("detail") or found.get("message")
    except (ValueError, RecursionError, AttributeError):
        return _decoded(data)
    if isinstance(said, dict):
        said = said.get("message", said)
    return printable(str(said)) if said else _decoded(data)


def _wait_s(retry_after: str | None) -> float | None:
    """Seconds of a Retry-After header; None without one, or where it is a date or nonsense."""
    try:
        wait = float(retry_after or "")
    except ValueError:
        return None
    return wait if math.isfinite(wait) and wait >= 0 else None


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no JSON")


def _decoded(data: bytes) -> str:
    return printable(data[: 4 * MOST_TEXT].decode("utf-8", "replace"))


@dataclass(frozen=True, slots=True)
class Address:
    """Where an endpoint is: `path` comes before /v1."""

    is_encrypted: bool
    host: str
    port: int
    path: str

    @property
    def name(self) -> str:
        """Host and port, to be shown."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether what is sent stays on this machine."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


def read_address(url: str) -> Address:
    """Read an endpoint's url, with or without /v1 at its end. Raises VlmError."""
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise VlmError(f"--vlm-url is no url: {error}") from None
    if parts.username is not None or parts.password is not None:
        raise VlmError("--vlm-url: no user or password in it; a token is given apart")
    if parts.scheme not in PORTS or not parts.hostname or is_odd(url):
        raise VlmError("--vlm-url is not like http://127.0.0.1:8000 or https://HOST/PATH")
    if parts.query or parts.fragment:
        raise VlmError("--vlm-url: give host, port and path alone")
    path = parts.path.rstrip("/").removesuffix("/v1")
    return Address(parts.scheme == "https", parts.hostname, port or PORTS[parts.scheme], path)


def check_token(token: str | None, address: Address) -> str | None:
    """Return a token that may be sent there. Raises VlmError, which does not repeat it."""
    if token is None:
        return None
    if not token or is_odd(token):
        raise VlmError("the token for --vlm-url is empty or holds spaces or control characters")
    if not address.is_encrypted and not address.is_loopback:
        raise VlmError(f"a token would travel in clear text to {address.name}: use https")
    return token


def is_odd(text: str) -> bool:
    """Whether there is a character in it that no url and no header should hold."""
    return not set(text) <= set(string.ascii_letters + string.digits + string.punctuation)


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
