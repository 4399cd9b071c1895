"""Sends HTTP requests to an address that the user chose, with a deadline and a bounded response.

It follows no redirect and reads no proxy from the environment, so a picture goes where the user
chose and nowhere else. This module does not know the requests' contents.
"""

from __future__ import annotations

import asyncio
import http
import ipaddress
import math
import os
import ssl
import string
import time
from collections.abc import Mapping
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from hapticvlm import errors
from hapticvlm.errors import HapticVLMError

if TYPE_CHECKING:
    import httpx2

PORTS = {"http": 80, "https": 443}
CONNECT_S = 5.0
SINCE_1970_S, SINCE_1970_MS = 1e9, 1e12  # a longer time to wait is a date
MAX_QUOTED_CHARS = 200  # of a peer's message that an error repeats


class HttpError(HapticVLMError):
    """An address or a token cannot be used, or the peer gave no complete response."""


@dataclass(frozen=True, slots=True)
class Address:
    """Address of an endpoint; `path` precedes that of a request, `query` follows it."""

    is_encrypted: bool
    host: str
    port: int
    path: str
    query: str = ""

    @property
    def name(self) -> str:
        """Host and port, for messages."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def url(self) -> str:
        """The URL that precedes the path of a request."""
        return f"http{'s' if self.is_encrypted else ''}://{self.name}{self.path}"

    @property
    def is_loopback(self) -> bool:
        """Whether requests stay on this machine."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


def read_address(url: str, flag: str) -> Address:
    """Parse a URL, with or without /v1 at its end. Raises HttpError.

    `flag` is the option that the URL was given with. Errors name the option and never the URL,
    because the URL may contain a password.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise HttpError(f"{flag} is not a URL: {error}") from None
    if parts.username is not None or parts.password is not None:
        raise HttpError(f"{flag}: no user or password may be in it; give a token separately")
    if parts.scheme not in PORTS or not parts.hostname or has_unsafe_characters(url):
        raise HttpError(f"{flag} is not like http://127.0.0.1:8000 or https://HOST/PATH")
    if parts.query or parts.fragment:
        raise HttpError(f"{flag} must not contain ? or #; give only host, port and path")
    path = parts.path.rstrip("/").removesuffix("/v1")
    return Address(parts.scheme == "https", parts.hostname, port or PORTS[parts.scheme], path)


def check_token(token: str | None, address: Address, flag: str) -> str | None:
    """Return the token if it may be sent to `address`. Raises HttpError, which does not repeat it.

    A token is sent only over an encrypted connection, or to this machine.
    """
    if token is None:
        return None
    if not token or has_unsafe_characters(token):
        raise HttpError(f"the token for {flag} is empty or holds spaces or control characters")
    if not address.is_encrypted and not address.is_loopback:
        raise HttpError(f"a token would travel in clear text to {address.name}: use https")
    return token


def has_unsafe_characters(text: str) -> bool:
    """Whether it contains a character that must not occur in a URL or a header."""
    return not set(text) <= set(string.ascii_letters + string.digits + string.punctuation)


def printable(text: str) -> str:
    """Return a peer's text as one short line that is safe to print."""
    return errors.printable(text, MAX_QUOTED_CHARS)


@dataclass(frozen=True, slots=True)
class Response:
    """Response of a peer: its status, its body as received, the time until it may be asked again.

    `wait_s` is in s, None if the peer names none. `target` is that of a redirect, else "".
    """

    status: int
    body: bytes
    wait_s: float | None
    target: str = ""


class HttpClient:
    """A client of one peer, which keeps its connection between requests. For one thread at a time.

    The library's timeouts apply to a single read, so a peer that sends one byte a second could hold
    a request for hours. Therefore its asynchronous interface is used, in a private event loop that
    runs only during a request. One deadline cancels the whole exchange, whether it is connecting,
    sending, waiting or reading. A cancelled exchange leaves no half-read response behind, since the
    library drops that connection. Only the look-up of a host's name cannot be cancelled; it lasts
    as long as the system's resolver takes.
    """

    def __init__(
        self,
        address: Address,
        token: str | None,
        content_type: str,
        max_bytes: int,
        header: str | None = None,
    ) -> None:
        """Set up a client without connecting. Raises ModuleNotFoundError without httpx2.

        A response of more than `max_bytes` is an HttpError. `header`: the one that carries the
        token as it is; None for a bearer token in Authorization.
        """
        import httpx2  # noqa: F401 - takes a quarter of a second, so only remote users load it

        self.address = address
        self._token = token
        self._header = header
        self._content_type = content_type
        self._max_bytes = max_bytes
        self._runner: asyncio.Runner | None = None
        self._client: httpx2.AsyncClient | None = None

    def request(self, verb: str, path: str, body: bytes | None, deadline: float) -> Response:
        """Send a request and return the response, complete before `deadline`.

        `deadline` is in s of `time.monotonic`. Raises HttpError for every failure of the exchange;
        a status of 400 or more is a response and not a failure.
        """
        import httpx2

        begun = time.monotonic()
        if self._runner is None or self._client is None:
            self._runner = asyncio.Runner()
            self._client = self._open()
        try:
            return self._runner.run(self._exchange(self._client, verb, path, body, deadline))
        except httpx2.ConnectTimeout:
            reason = f"{self.address.name} does not accept the connection"
        except TimeoutError:
            reason = f"incomplete response after {round(max(0.0, deadline - begun), 2):g} s"
        except (httpx2.HTTPError, OSError) as error:
            reason = _reason(error)
        raise HttpError(self.redacted(reason))

    def url_of(self, path: str) -> str:
        """Return the URL that a request of this path goes to."""
        return self.address.url + path + self.address.query

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        if self._runner is not None and self._client is not None:
            self._runner.run(self._client.aclose())
            self._runner.close()
        self._runner = self._client = None

    def redacted(self, text: str) -> str:
        """Return a text without the token, which a peer may have repeated in its message."""
        return text if self._token is None else text.replace(self._token, "(token)")

    def _open(self) -> httpx2.AsyncClient:
        import httpx2

        headers = {"Content-Type": self._content_type, "Accept-Encoding": "identity"}
        if self._token is not None:
            bearer = {"Authorization": f"Bearer {self._token}"}
            headers |= bearer if self._header is None else {self._header: self._token}
        return httpx2.AsyncClient(
            headers=headers,
            verify=ssl.create_default_context() if self.address.is_encrypted else False,
            trust_env=False,
            follow_redirects=False,
            timeout=httpx2.Timeout(None, connect=CONNECT_S),
        )

    async def _exchange(
        self,
        client: httpx2.AsyncClient,
        verb: str,
        path: str,
        body: bytes | None,
        deadline: float,
    ) -> Response:
        async with (
            asyncio.timeout(deadline - time.monotonic()),
            client.stream(verb, self.url_of(path), content=body) as response,
        ):
            data = bytearray()
            async for chunk in response.aiter_raw():
                data += chunk
                if len(data) > self._max_bytes:
                    raise HttpError(f"the response is larger than {self._max_bytes} bytes")
            wait_s = _wait_s(response.headers, response.status_code)
            target = printable(response.headers.get("location", ""))
            return Response(response.status_code, bytes(data), wait_s, target)


def _wait_s(headers: Mapping[str, str], status: int) -> float | None:
    """Return the seconds that a peer asks to wait; None if it names no time that makes sense.

    Retry-After holds seconds or a date (RFC 9110, 10.2.3); some endpoints send milliseconds in a
    header of their own, or with 429 the time of a reset, in s or ms from now or since 1970.
    """
    names = [("retry-after-ms", 1e-3), ("retry-after", 1.0)]
    if status == http.HTTPStatus.TOO_MANY_REQUESTS:
        names.append(("x-ratelimit-reset", 1.0))
    for name, unit_s in names:
        text = headers.get(name, "").removesuffix("s")
        try:
            wait = float(text) * unit_s
            wait = wait / 1e3 if wait > SINCE_1970_MS else wait
            wait = wait - time.time() if wait > SINCE_1970_S else wait
        except ValueError:
            try:
                wait = parsedate_to_datetime(text).timestamp() - time.time()
            except (ValueError, OverflowError):
                continue
        if math.isfinite(wait) and wait >= 0:
            return wait
    return None


def _reason(error: BaseException) -> str:
    """Return in one line why a connection failed, by the first error in the chain of causes."""
    reason = ""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, ConnectionError) and cause.errno is not None:
            return os.strerror(cause.errno)
        reason = printable(str(cause)) or reason
        cause = cause.__cause__ or cause.__context__
    return reason or type(error).__name__
