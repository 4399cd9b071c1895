"""One HTTP connection to a machine that the user named: address, token, one deadline, bounded size.

The standard library's client, because it follows no redirect and reads no proxy from the
environment: a picture goes where the user chose and nowhere else. One deadline holds for a whole
exchange, so that a peer which dribbles a byte a second is cut off like one which is silent. Knows
no question and no answer.
"""

from __future__ import annotations

import http.client
import io
import ipaddress
import socket
import ssl
import string
import time
from dataclasses import dataclass
from urllib.parse import urlsplit

from hapticvlm import errors
from hapticvlm.errors import HapticVLMError

PORTS = {"http": 80, "https": 443}
CONNECT_S = 5.0
MOST_TEXT = 200  # characters of a peer's own words that an error repeats


class LineError(HapticVLMError):
    """An address or a token that cannot be used, or a peer that gave no whole answer."""


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


def read_address(url: str, flag: str) -> Address:
    """Read a url, with or without /v1 at its end; `flag` is where it was given. Raises LineError.

    The name of the flag and never the url stands in an error: there may be a password in it.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise LineError(f"{flag} is no url: {error}") from None
    if parts.username is not None or parts.password is not None:
        raise LineError(f"{flag}: no user or password in it; a token is given apart")
    if parts.scheme not in PORTS or not parts.hostname or is_odd(url):
        raise LineError(f"{flag} is not like http://127.0.0.1:8000 or https://HOST/PATH")
    if parts.query or parts.fragment:
        raise LineError(f"{flag}: give host, port and path alone")
    path = parts.path.rstrip("/").removesuffix("/v1")
    return Address(parts.scheme == "https", parts.hostname, port or PORTS[parts.scheme], path)


def check_token(token: str | None, address: Address, flag: str) -> str | None:
    """Return a token that may be sent there. Raises LineError, which does not repeat it."""
    if token is None:
        return None
    if not token or is_odd(token):
        raise LineError(f"the token for {flag} is empty or holds spaces or control characters")
    if not address.is_encrypted and not address.is_loopback:
        raise LineError(f"a token would travel in clear text to {address.name}: use https")
    return token


def is_odd(text: str) -> bool:
    """Whether there is a character in it that no url and no header should hold."""
    return not set(text) <= set(string.ascii_letters + string.digits + string.punctuation)


def printable(text: str) -> str:
    """Cut foreign words short and drop what could forge a line of a log."""
    return errors.printable(text, MOST_TEXT)


class Line:
    """What http.client calls of a socket, every send and read of it before `deadline`.

    The deadline is of `time.monotonic`, s; it may be set anew for the next exchange.
    """

    def __init__(self, sock: socket.socket, deadline: float) -> None:
        self.deadline = deadline
        self._sock = sock

    def sendall(self, data: bytes) -> None:
        """Send all of it. Raises TimeoutError."""
        self._sock.settimeout(left_s(self.deadline))
        self._sock.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        """Return the answer as a file; each read of it is before the deadline."""
        return io.BufferedReader(_Reader(self._sock, self.deadline))

    def close(self) -> None:
        """Leave the socket to its owner: http.client drops it before the body is read."""


class _Reader(io.RawIOBase):
    def __init__(self, sock: socket.socket, deadline: float) -> None:
        self._sock = sock
        self._deadline = deadline

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        self._sock.settimeout(left_s(self._deadline))
        return self._sock.recv_into(buffer)


def connect(address: Address, deadline: float) -> socket.socket:
    """Open the connection; raises LineError, TimeoutError and OSError.

    Looking up a name takes as long as the system's resolver does.
    """
    place = (address.host, address.port)
    try:
        sock = socket.create_connection(place, timeout=min(CONNECT_S, left_s(deadline)))
    except TimeoutError:
        raise LineError(f"{address.name} does not take the connection") from None
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if not address.is_encrypted:
        return sock
    try:
        return ssl.create_default_context().wrap_socket(sock, server_hostname=address.host)
    except BaseException:
        sock.close()
        raise


def left_s(deadline: float) -> float:
    """Seconds until then. Raises TimeoutError when none are left."""
    left = deadline - time.monotonic()
    if left <= 0:
        raise TimeoutError
    return left


def read_body(response: http.client.HTTPResponse, most_bytes: int) -> bytes:
    """Read a body of at most so many bytes, whole. Raises LineError."""
    announced = response.length or 0
    data = b"" if announced > most_bytes else response.read(most_bytes + 1)
    if announced > most_bytes or len(data) > most_bytes:
        raise LineError(f"the endpoint's answer is larger than {most_bytes} bytes")
    if response.length:
        raise LineError(f"the endpoint's answer ends {response.length} bytes early")
    return data
