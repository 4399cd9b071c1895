"""Serves pages to browsers of the local network, only where `--pages-from lan` asks for it.

A browser gives the token as the password (RFC 7617): never in an address, which ends in
histories and logs. Which names mean this service is checked too: a page that had its own name
pointed here (DNS rebinding) is refused whatever it knows. And where others open the pages: an
address, and a code of it for a camera.
"""

from __future__ import annotations

import base64
import binascii
import hmac
import io
import ipaddress
import socket
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from urllib.parse import urlsplit

import segno

from hapticvlm.server.addresses import parsed

CHALLENGE = 'Basic realm="HapticVLM: any name, and the token as password", charset="UTF-8"'
ANYWHERE = ("192.0.2.1", 9)  # TEST-NET-1 (RFC 5737): nothing is sent to it
HERE_ONLY = "Pages go to this machine only. For a phone or headset start `hapticvlm serve --lan`."


@dataclass(frozen=True, slots=True)
class LanPages:
    """Lets browsers of the local network in by token; `names` are this service's own."""

    token: str
    names: frozenset[str]
    scheme: str

    def refusal(self, peer: str, host: str) -> str | None:
        """Return why a browser at address `peer` that asked for `host` gets no page, or None."""
        if not is_near(peer):
            return "pages are served to the local network only"
        if not self._is_ours(host):
            return f"Host {host[:80]!r} is not this machine: use its address"
        return None

    def is_own_origin(self, origin: str, host: str) -> bool:
        """Return whether a page that this service served, and no other, has this origin."""
        return origin == f"{self.scheme}://{host}" and self._is_ours(host)

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname
        except ValueError:
            return False
        # A page of any site can have its own name point to this machine and then read from it as
        # from itself (DNS rebinding). Its browser still says that name to us, so a name that is
        # not ours is refused. A bare address is safe: nobody can point an address elsewhere.
        return name is not None and (name in self.names or parsed(name) is not None)


def is_token(authorization: str, token: str) -> bool:
    """Return whether an Authorization header holds the token."""
    scheme, _, given = authorization.partition(" ")
    if scheme.lower() != "basic":
        return False
    try:
        _, _, password = base64.b64decode(given, validate=True).partition(b":")
    except (binascii.Error, ValueError):
        return False
    # Compared in a time that does not depend on how many characters are right, or a token could be
    # found one character after the other.
    return hmac.compare_digest(password, token.encode())


def own_names(certified: Iterable[str] = ()) -> frozenset[str]:
    """Return the names this machine has, with those it is certified for, in lower case."""
    name = socket.gethostname().lower()
    return frozenset({"localhost", name, f"{name}.local", *(host.lower() for host in certified)})


def is_near(peer: str) -> bool:
    """Return whether an address is of this machine or of a private network."""
    address = parsed(peer)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address is not None and (address.is_private or address.is_link_local)


def reach(lan_pages: LanPages | None, port: int) -> dict[str, str | None]:
    """Report where others of the local network open the pages, or why they cannot."""
    if lan_pages is None:
        return {"page": None, "why": HERE_ONLY}
    host = own_address() or socket.gethostname()
    return {"page": f"{lan_pages.scheme}://{host}:{port}/", "why": None}


def qr_code(page: str) -> str:
    """Draw an address as a QR code (ISO/IEC 18004), SVG."""
    drawn = io.BytesIO()
    segno.make(page, error="m").save(drawn, kind="svg", scale=8, border=2, xmldecl=False)
    return drawn.getvalue().decode()


def own_address() -> str | None:
    """Return the address the network knows this machine by, without sending anything."""
    with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(ANYWHERE)  # UDP only picks the interface
        return str(probe.getsockname()[0])
    return None
