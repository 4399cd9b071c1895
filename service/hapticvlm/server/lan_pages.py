"""Browsers of the local network: served pages only where that was asked for, and for the token.

A page is asked for with the token as the password (RFC 7617): never in an address, which ends in
histories and logs. Which names mean this service is checked too: a page that had its own name
pointed here (DNS rebinding) is refused whatever it knows.
"""

from __future__ import annotations

import base64
import binascii
import hmac
import ipaddress
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import urlsplit

CHALLENGE = 'Basic realm="HapticVLM: any name, and the token as password", charset="UTF-8"'


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
        return name is not None and (name in self.names or _address(name) is not None)


def is_token(authorization: str, token: str) -> bool:
    """Return whether an Authorization header holds the token."""
    scheme, _, given = authorization.partition(" ")
    if scheme.lower() != "basic":
        return False
    try:
        _, _, password = base64.b64decode(given, validate=True).partition(b":")
    except (binascii.Error, ValueError):
        return False
    return hmac.compare_digest(password, token.encode())


def own_names(certified: Iterable[str] = ()) -> frozenset[str]:
    """Return the names this machine has, with those it is certified for, in lower case."""
    name = socket.gethostname().lower()
    return frozenset({"localhost", name, f"{name}.local", *(host.lower() for host in certified)})


def is_near(peer: str) -> bool:
    """Return whether an address is of this machine or of a private network."""
    address = _address(peer)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address is not None and (address.is_private or address.is_link_local)


def _address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None
