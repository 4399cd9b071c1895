"""Where an endpoint is, read from what the user typed, and whether a token may go there. Pure.

Plain http is taken as far as the user's own url says so: pictures then travel in clear text. A
token does not, except to this machine.
"""

from __future__ import annotations

import ipaddress
import string
from dataclasses import dataclass
from urllib.parse import urlsplit

from hapticvlm.recognition.vlm.answers import VlmError

PORTS = {"http": 80, "https": 443}


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


def read_address(url: str) -> Address:
    """Read an endpoint's url, with or without /v1 at its end. Raises VlmError."""
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise VlmError(f"--vlm-url is no url: {error}") from None
    if parts.username is not None or parts.password is not None:
        raise VlmError("--vlm-url: no user or password in it; a token is given apart")
    if parts.scheme not in PORTS or not parts.hostname or is_odd(url):
        raise VlmError("--vlm-url is not like http://127.0.0.1:8000 or https://HOST/PATH")
    if parts.query or parts.fragment:
        raise VlmError("--vlm-url: give host, port and path alone")
    path = parts.path.rstrip("/").removesuffix("/v1")
    return Address(parts.scheme == "https", parts.hostname, port or PORTS[parts.scheme], path)


def check_token(token: str | None, address: Address) -> str | None:
    """Return a token that may be sent there. Raises VlmError, which does not repeat it."""
    if token is None:
        return None
    if not token or is_odd(token):
        raise VlmError("the token for --vlm-url is empty or holds spaces or control characters")
    if not address.is_encrypted and not address.is_loopback:
        raise VlmError(f"a token would travel in clear text to {address.name}: use https")
    return token


def is_odd(text: str) -> bool:
    """Whether there is a character in it that no url and no header should hold."""
    return not set(text) <= set(string.ascii_letters + string.digits + string.punctuation)
