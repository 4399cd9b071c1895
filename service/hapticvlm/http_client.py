"""One HTTP connection to a machine that the user named: address, token, one deadline, bounded size.

No redirect is followed and no proxy read from the environment: a picture goes where the user chose
and nowhere else. Knows no question and no answer.
"""

from __future__ import annotations

import asyncio
import ipaddress
import os
import ssl
import string
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from hapticvlm import errors
from hapticvlm.errors import HapticVLMError

if TYPE_CHECKING:
    import httpx2

PORTS = {"http": 80, "https": 443}
CONNECT_S = 5.0
MAX_QUOTED_CHARS = 200  # characters of a peer's own words that an error repeats


class HttpError(HapticVLMError):
    """An address or a token that cannot be used, or a peer that gave no complete response."""


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
    def url(self) -> str:
        """The url without /v1."""
        return f"http{'s' if self.is_encrypted else ''}://{self.name}{self.path}"

    @property
    def is_loopback(self) -> bool:
        """Whether what is sent stays on this machine."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


def read_address(url: str, flag: str) -> Address:
    """Read a url, with or without /v1 at its end; `flag` is where it was given. Raises HttpError.

    The name of the flag and never the url stands in an error: there may be a password in it.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise HttpError(f"{flag} is no url: {error}") from None
    if parts.username is not None or parts.password is not None:
        raise HttpError(f"{flag}: no user or password in it; a token is given apart")
    if parts.scheme not in PORTS or not parts.hostname or has_unsafe_characters(url):
        raise HttpError(f"{flag} is not like http://127.0.0.1:8000 or https://HOST/PATH")
    if parts.query or parts.fragment:
        raise HttpError(f"{flag}: give host, port and path alone")
    path = parts.path.rstrip("/").removesuffix("/v1")
    return Address(parts.scheme == "https", parts.hostname, port or PORTS[parts.scheme], path)


def check_token(token: str | None, address: Address, flag: str) -> str | None:
    """Return a token that may be sent there. Raises HttpError, which does not repeat it."""
    if token is None:
        return None
    if not token or has_unsafe_characters(token):
        raise HttpError(f"the token for {flag} is empty or holds spaces or control characters")
    if not address.is_encrypted and not address.is_loopback:
        raise HttpError(f"a token would travel in clear text to {address.name}: use https")
    return token


def has_unsafe_characters(text: str) -> bool:
    """Whether there is a character in it that no url and no header should hold."""
    return not set(text) <= set(string.ascii_letters + string.digits + string.punctuation)


def printable(text: str) -> str:
    """Cut foreign words short and drop what could forge a line of a log."""
    return errors.printable(text, MAX_QUOTED_CHARS)


@dataclass(frozen=True, slots=True)
class Response:
    """What a peer responded: its status, its body as it came, its Retry-After header."""

    status: int
    body: bytes
    retry_after: str | None


class HttpClient:
    """A client of one peer, whose connection is kept between requests. For one thread at a time.

    The library's own time limits are those of one read: a peer that sends a byte a second would
    hold a request for hours. So its asynchronous half is used, in a private event loop that runs
    only while a request is under way, and one deadline cancels the whole exchange wherever it
    stands: connecting, sending, waiting, reading. A cancelled exchange leaves no half-read
    response behind, since the library then drops that connection. Looking up a host's name alone
    cannot be cancelled; it lasts as long as the system's resolver takes.
    """

    def __init__(
        self, address: Address, token: str | None, content_type: str, max_bytes: int
    ) -> None:
        """Send nothing yet. Raises ModuleNotFoundError without httpx2."""
        import httpx2  # noqa: F401 - a quarter of a second, for those alone who ask elsewhere

        self.address = address
        self._token = token
        self._content_type = content_type
        self._max_bytes = max_bytes
        self._runner: asyncio.Runner | None = None
        self._client: httpx2.AsyncClient | None = None

    def request(self, verb: str, path: str, body: bytes | None, deadline: float) -> Response:
        """Send a request; the whole response is there before `deadline` (`time.monotonic`, s).

        Raises HttpError, whatever goes wrong; a status of 400 is a response like any other.
        """
        import httpx2

        begun = time.monotonic()
        if self._runner is None or self._client is None:
            self._runner = asyncio.Runner()
            self._client = self._open()
        try:
            return self._runner.run(self._exchange(self._client, verb, path, body, deadline))
        except httpx2.ConnectTimeout:
            text = f"{self.address.name} does not take the connection"
        except TimeoutError:
            text = f"incomplete response after {round(max(0.0, deadline - begun), 2):g} s"
        except (httpx2.HTTPError, OSError) as error:
            text = _reason(error)
        raise HttpError(self.redacted(text))

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        if self._runner is not None and self._client is not None:
            self._runner.run(self._client.aclose())
            self._runner.close()
        self._runner = self._client = None

    def redacted(self, text: str) -> str:
        """Return a text without the token, which a peer may have put into its own words."""
        return text if self._token is None else text.replace(self._token, "(token)")

    def _open(self) -> httpx2.AsyncClient:
        import httpx2

        headers = {"Content-Type": self._content_type, "Accept-Encoding": "identity"}
        if self._token is not None:
            headers["Authorization"] = f"Bearer {self._token}"
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
            client.stream(verb, self.address.url + path, content=body) as response,
        ):
            data = bytearray()
            async for chunk in response.aiter_raw():
                data += chunk
                if len(data) > self._max_bytes:
                    raise HttpError(f"a response larger than {self._max_bytes} bytes")
            return Response(response.status_code, bytes(data), response.headers.get("Retry-After"))


def _reason(error: BaseException) -> str:
    """Put on one line why a connection failed: the error that all others came of says it best."""
    reason = ""
    found: BaseException | None = error
    while found is not None:
        if isinstance(found, ConnectionError) and found.errno is not None:
            return os.strerror(found.errno)
        reason = printable(str(found)) or reason
        found = found.__cause__ or found.__context__
    return reason or type(error).__name__
