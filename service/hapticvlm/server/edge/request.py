"""Reads the one request of a connection, once: method, path, host, origin, upgrade. Pure.

A request comes from anybody who can reach the port. It is read here and nowhere else: pages get an
`HttpRequest` whose fields were checked, and never a header. A request that HTTP/1.1 does not allow
(RFC 9112), or that means two things at once, is refused in words by `RequestError`.
"""

from __future__ import annotations

import http
import re
from dataclasses import dataclass
from urllib.parse import urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

METHODS = ("GET", "HEAD")
MAX_HEADERS = 128
MAX_LINE_BYTES = 8192  # of the first line

_END = b"\r\n\r\n"
_BARE_LINE_END = re.compile(rb"(?<!\r)\n")
# Names are tokens (RFC 9110, 5.6.2); values are visible characters, blanks and obs-text (5.5).
_TOKEN = re.compile(rb"[-!#$%&'*+.^_`|~0-9A-Za-z]+")
_VALUE = re.compile(rb"[\t\x20-\x7e\x80-\xff]*")
_TARGET = re.compile(rb"[\x21-\x7e]+")


class RequestError(Exception):
    """A request that is refused: with this status of HTTP, and for this reason."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status
        self.text = text


@dataclass(frozen=True, slots=True)
class HttpRequest:
    """A request that was read.

    `path` starts with a slash and has no query; its percent-encoding is as it was sent. `host` is
    the authority that the client asked for, with its port. `authorization` is None without such a
    header and empty where there are several. `is_upgrade`: a WebSocket is asked for and no page.
    `site`, `mode` and `dest` are what a browser says of the fetch (Sec-Fetch-*), None elsewhere.
    `handshake` is the request as websockets takes it.
    """

    method: str
    path: str
    host: str
    origin: str | None
    authorization: str | None
    is_upgrade: bool
    site: str | None
    mode: str | None
    dest: str | None
    handshake: Request

    @property
    def is_cross_site(self) -> bool:
        """Whether a browser fetches this for a page of another site; opening it is allowed."""
        is_opened = self.mode == "navigate"
        is_framed = self.dest in ("iframe", "frame", "object", "embed")
        return self.site in ("cross-site", "same-site") and (not is_opened or is_framed)


class RequestReader:
    """Collects the bytes of a request of at most `max_bytes` until it is complete."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._data = bytearray()
        self.held = 0  # bytes that are kept

    def feed(self, data: bytes) -> tuple[HttpRequest, bytes] | None:
        """Take the next bytes; return the request and the bytes behind it once it is complete.

        Raises RequestError as soon as the bytes cannot become a request.
        """
        begins_at = max(0, len(self._data) - len(_END))
        self._data += data
        self.held = len(self._data)
        if not _TOKEN.match(self._data):
            text = "this is not a request of HTTP/1.1; for an encrypted service use https or wss"
            raise RequestError(400, text)
        if len(self._data) > MAX_LINE_BYTES and self._data.find(b"\r\n", 0, MAX_LINE_BYTES) < 0:
            raise RequestError(414, f"the first line has more than {MAX_LINE_BYTES} bytes")
        ends_at = self._data.find(_END, begins_at)
        size = len(self._data) if ends_at < 0 else ends_at + len(_END)
        # A line that ends without a carriage return would be read in two ways by two programs.
        if _BARE_LINE_END.search(self._data, begins_at, size):
            raise RequestError(400, "a line of the request does not end with CR LF")
        if size > self._max_bytes:
            text = f"the request has more than {self._max_bytes} bytes: delete cookies of this host"
            raise RequestError(431, text)
        if ends_at < 0:
            return None
        head, rest = bytes(self._data[:ends_at]), bytes(self._data[size:])
        self._data = bytearray()
        self.held = 0
        return parse(head), rest


def parse(head: bytes) -> HttpRequest:
    """Read a request without the empty line that ends it. Raises RequestError."""
    first, *lines = head.split(b"\r\n")
    method, target, version = _first_line(first)
    headers = _headers(lines)
    host = _single(headers, "Host")
    if method not in METHODS:
        raise RequestError(405, f"{method[:20]} is not answered here: use GET or HEAD")
    if "Transfer-Encoding" in headers or set(headers.get_all("Content-Length")) - {"0"}:
        raise RequestError(400, "a request has no body here")
    if host is None:
        raise RequestError(400, "the request has no Host header")
    path, named_host = _path(target)
    authorizations = headers.get_all("Authorization")
    return HttpRequest(
        method=method,
        path=path,
        host=host if named_host is None else named_host,
        origin=_single(headers, "Origin"),
        authorization="" if len(authorizations) > 1 else next(iter(authorizations), None),
        is_upgrade=method == "GET"
        and "upgrade" in _words(headers, "Connection")
        and "websocket" in _words(headers, "Upgrade"),
        site=_single(headers, "Sec-Fetch-Site"),
        mode=_single(headers, "Sec-Fetch-Mode"),
        dest=_single(headers, "Sec-Fetch-Dest"),
        handshake=Request(target, headers, method=method, protocol=version),
    )


def refusal(error: RequestError) -> Response:
    """Return the answer to a request that could not be read or answered."""
    body = f"{error.text}\n".encode()
    headers = Headers(
        [
            ("Content-Type", "text/plain; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Connection", "close"),
            ("X-Content-Type-Options", "nosniff"),
            ("Cache-Control", "no-store"),
        ]
    )
    if error.status == http.HTTPStatus.METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(METHODS)
    return Response(error.status, http.HTTPStatus(error.status).phrase, headers, body)


def _first_line(line: bytes) -> tuple[str, str, str]:
    parts = line.split(b" ")
    if len(parts) != 3 or not _TOKEN.fullmatch(parts[0]) or not _TARGET.fullmatch(parts[1]):
        raise RequestError(400, "the first line is not `METHOD target HTTP/1.1`")
    if parts[2] not in (b"HTTP/1.1", b"HTTP/1.0"):
        raise RequestError(400, "the version is not HTTP/1.1")
    method, target, version = (part.decode("ascii") for part in parts)
    return method, target, version


def _headers(lines: list[bytes]) -> Headers:
    if len(lines) > MAX_HEADERS:
        raise RequestError(431, f"the request has more than {MAX_HEADERS} headers")
    headers = Headers()
    for line in lines:
        name, colon, value = line.partition(b":")
        if not colon or not _TOKEN.fullmatch(name) or not _VALUE.fullmatch(value):
            raise RequestError(400, "a header is not `Name: value` on one line")
        headers[name.decode("ascii")] = value.strip(b" \t").decode("iso-8859-1")
    return headers


def _single(headers: Headers, name: str) -> str | None:
    """Return the value of a header that may stand once. Raises RequestError."""
    values = headers.get_all(name)
    if len(values) > 1:
        raise RequestError(400, f"the request has more than one {name} header")
    return values[0] if values else None


def _words(headers: Headers, name: str) -> set[str]:
    """Return the words of a list header, in lower case; it may stand on several lines."""
    return {word.strip().lower() for value in headers.get_all(name) for word in value.split(",")}


def _path(target: str) -> tuple[str, str | None]:
    """Return the path of a target, and the host that an absolute target names.

    Raises RequestError.
    """
    if target.startswith("/") and not target.startswith("//"):
        return re.split(r"[?#]", target, maxsplit=1)[0], None
    try:
        # A target with a host takes the place of the Host header (RFC 9112, 3.2.2).
        parts = urlsplit(target)
        host = parts.hostname
    except ValueError:
        host = None
    if host is None or parts.scheme not in ("http", "https", "ws", "wss"):
        raise RequestError(400, "the target is not a path that starts with one slash")
    return parts.path or "/", parts.netloc.rpartition("@")[2]
