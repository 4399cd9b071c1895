"""Answers requests before a WebSocket begins: checks hosts and origins, serves the static pages.

Origin: absent (native clients) and loopback are accepted, anything else only if listed. Host: a
loopback service accepts loopback names only, which stops DNS rebinding. Pages go to loopback only,
or to the local network for the token (lan_pages.py).
"""

from __future__ import annotations

import http
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Response

from hapticvlm.server.addresses import is_loopback, parsed
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.web import metrics
from hapticvlm.server.web.lan_pages import CHALLENGE, HERE_ONLY, LanPages, is_token, qr_code, reach
from hapticvlm.server.web.scene_files import TYPES

PAGE_TYPES = TYPES | {".jpg": "image/jpeg"}
# Pages by a shorter address, and the icon that a browser asks for where a page names none.
NAMES = {"/": "index.html", "/try": "try.html", "/favicon.ico": "icon.svg"}
CODES = {"/connect.svg": "", "/connect-try.svg": "try"}  # pictures of the addresses to open
TOKEN = "/token"  # for a page whose browser has given the token
ALIVE = "/healthz"
REPORTS = ("/readyz", "/metrics")
PAGES = Path(__file__).parents[2] / "pages"
CSP = "default-src 'self'; frame-ancestors 'none'; base-uri 'none'"


class Ends(Protocol):
    """Address and port of both ends of a connection."""

    @property
    def remote_address(self) -> tuple[str, int]:
        """Address and port of the client."""

    @property
    def local_address(self) -> tuple[str, int]:
        """Address and port of this service."""


@dataclass(frozen=True, slots=True)
class AccessPolicy:
    """The rules of admission; `host` is the address the service listens on.

    Without `lan_pages` pages go to this machine only. `names` are this machine's own, `tunnels`
    those under which others may reach it on loopback, too. A study is
    open to its own pages only: another program's page on this machine must not answer a trial.
    """

    host: str
    allowed_origins: frozenset[str]
    scene_folder: Path | None = None
    lan_pages: LanPages | None = None
    names: frozenset[str] = frozenset()
    token: str | None = None
    pages: tuple[Path, ...] = (PAGES,)  # folders whose files are pages; the first that has one
    is_open_to_own_pages_only: bool = False
    tunnels: frozenset[str] = frozenset()

    def refusal(self, request: HttpRequest) -> str | None:
        """Return why a request is refused, or None."""
        host, origin = request.host, request.origin
        if not self._is_ours(_host_of("//" + host)):
            return (
                f"Host {host[:80]!r} is not this machine: use its name or address, or --allow-host"
            )
        if self.is_open_to_own_pages_only:
            is_own = origin is None or origin == f"http://{host}"
            return None if is_own else "only the study's own pages may connect"
        if origin is None or origin in self.allowed_origins or is_loopback(_host_of(origin)):
            return None
        if _host_of(origin) in self.tunnels and _host_of(origin) == _host_of("//" + host):
            return None  # a page that came through the tunnel
        if self.lan_pages is not None and self.lan_pages.is_own_origin(origin, host):
            return None
        if origin == "null":  # of every file and every sandboxed frame: no page may be named by it
            return (
                "a page without an origin is not allowed: serve it, with `hapticvlm serve --scene`"
            )
        return f"Origin {origin[:80]!r} is not allowed: start with --allow-origin {origin[:80]}"

    def _is_ours(self, host: str | None) -> bool:
        """Whether a Host header means this service: a page's own name may be pointed here."""
        if is_loopback(host) or host in self.tunnels:
            return True
        if host is None or is_loopback(self.host):
            return False
        return host in self.names or parsed(host) is not None


def hosts_of(origins: Iterable[str]) -> frozenset[str]:
    """Return the host names of these origins."""
    return frozenset(host for host in map(_host_of, origins) if host is not None)


def answer(
    connection: Ends,
    request: HttpRequest,
    policy: AccessPolicy,
    status: Callable[[], dict[str, Any]] | None,
) -> Response | None:
    """Refuse, serve a page, or return None to continue the WebSocket handshake.

    Without `status` (a study) there are pages, and no reports on a service.
    """
    refused = refuse(connection, request, policy)
    if refused is not None or request.is_upgrade:
        return refused
    path = request.path
    if path == ALIVE:
        return response(200, "ok\n")
    if status is not None and path in REPORTS:
        return _report(path, status())
    if status is not None and path == "/status":
        found = {**status(), "reach": reach(policy.lan_pages, connection.local_address[1])}
        return response(200, json.dumps(found) + "\n", "application/json")
    if path == TOKEN:
        return _token(policy.token, request)
    if path in CODES:
        return _code(policy.lan_pages, connection.local_address[1], CODES[path])
    return _page(path, policy.pages)


def refuse(connection: Ends, request: HttpRequest, policy: AccessPolicy) -> Response | None:
    """Refuse a WebSocket or a browser that may not come in; None: it may."""
    refusal = policy.refusal(request)
    if refusal is not None:
        return response(403, refusal + "\n")
    if request.is_upgrade:
        return None
    return turn_away(connection.remote_address[0], request, policy.lan_pages)


def _report(path: str, status: dict[str, Any]) -> Response:
    """Answer a program that watches the service."""
    if path == "/metrics":
        return response(200, metrics.render(status), metrics.TYPE)
    found = metrics.obstacles(status)
    return response(503 if found else 200, "".join(f"{text}\n" for text in found) or "ok\n")


def turn_away(peer: str, request: HttpRequest, lan_pages: LanPages | None) -> Response | None:
    """Refuse a browser that may not see pages, or ask it for the token; None: it may."""
    if request.is_cross_site:
        return response(403, "asked for by a page of another site\n")
    if is_loopback(peer):
        return None
    if lan_pages is None:
        return response(403, "pages are served to this machine only: start it with --lan\n")
    refusal = lan_pages.refusal(peer, request.host)
    if refusal is not None:
        return response(403, refusal + "\n")
    return ask_for(lan_pages.token, request)


def ask_for(token: str, request: HttpRequest) -> Response | None:
    """Ask a browser for the token, or return None: it has given it."""
    if request.authorization is not None and is_token(request.authorization, token):
        return None
    asking = response(401, "the token is the password; any name will do\n")
    asking.headers["WWW-Authenticate"] = CHALLENGE
    return asking


def _token(token: str | None, request: HttpRequest) -> Response:
    """Tell a page the token with which its browser got the page, so that nobody types it twice."""
    # Browsers of this machine get pages without a token. They get no token either, and no question:
    # a page that asks here must not open the browser's own dialog.
    if token is None or request.authorization is None:
        return response(404, "no token was given\n")
    if not is_token(request.authorization, token):
        return response(404, "not the token\n")
    return response(200, token)


def _code(lan_pages: LanPages | None, port: int, place: str) -> Response:
    page = reach(lan_pages, port)["page"]
    if page is None:
        return response(404, f"{HERE_ONLY}\n")
    return response(200, qr_code(page + place), TYPES[".svg"])


def _page(path: str, folders: Sequence[Path]) -> Response:
    """Serve a file of the pages by its name; a name is looked up and never joined to a folder."""
    name = NAMES.get(path, path.removeprefix("/"))
    found = (page for folder in folders for page in folder.iterdir() if page.suffix in PAGE_TYPES)
    page = next((page for page in found if page.name == name), None)
    if page is None:
        return response(404, "no such page\n")
    return response(200, page.read_bytes(), PAGE_TYPES[page.suffix])


def response(
    code: int, text: str | bytes, kind: str = "text/plain; charset=utf-8", csp: str = CSP
) -> Response:
    """Answer with a text, never kept by the browser and open to no other site."""
    body = text.encode() if isinstance(text, str) else text
    headers = Headers(
        [
            ("Content-Type", kind),
            ("Content-Length", str(len(body))),
            ("Connection", "close"),
            ("Content-Security-Policy", csp),
            ("X-Content-Type-Options", "nosniff"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cache-Control", "no-store"),
        ]
    )
    return Response(code, http.HTTPStatus(code).phrase, headers, body)


def _host_of(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None
