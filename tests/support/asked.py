"""Requests as browsers send them, read as the service reads them."""

from __future__ import annotations

from hapticvlm.server.edge.request import HttpRequest, parse


def asked(target: str = "/", *more: tuple[str, str], host: str = "127.0.0.1") -> HttpRequest:
    """Return a request for a target, with these headers beside Host."""
    lines = [f"GET {target} HTTP/1.1", f"Host: {host}"]
    lines += [f"{name}: {value}" for name, value in more]
    return parse("\r\n".join(lines).encode("latin-1"))
