"""Tells addresses of this machine from others. Pure."""

from __future__ import annotations

import ipaddress

ADDRESSES = "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of its IPv4 addresses"


def is_loopback(host: str | None) -> bool:
    """Return whether a host name or address means this machine."""
    if host is None:
        return False
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def require_address(host: str) -> None:
    """Refuse a malformed IP address; a name is the system's to look up. Raises ValueError."""
    try:
        if not host or ":" in host or host.rpartition(".")[2].isdigit():
            ipaddress.ip_address(host)
    except ValueError:
        raise ValueError(f"--host {host!r}: not an IP address; {ADDRESSES}") from None
