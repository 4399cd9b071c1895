"""Tells addresses of this machine from others. Pure."""

from __future__ import annotations

import ipaddress

ADDRESSES = "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of its IPv4 addresses"


def is_loopback(host: str | None) -> bool:
    """Return whether a host name or address means this machine."""
    if host is None:
        return False
    address = parsed(host)
    return host == "localhost" or (address is not None and address.is_loopback)


def parsed(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return a host as an IP address, or None if it is a name."""
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


def require_address(host: str) -> None:
    """Refuse a malformed IP address; a name is the system's to look up. Raises ValueError."""
    is_meant_as_one = not host or ":" in host or host.rpartition(".")[2].isdigit()
    if is_meant_as_one and parsed(host) is None:
        raise ValueError(f"--host {host!r}: not an IP address; {ADDRESSES}")
