"""The address of the service and its access rules; unsafe combinations are refused here."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hapticvlm.server.addresses import is_loopback, require_address
from hapticvlm.server.web import http
from hapticvlm.server.web.certificate import Certificate
from hapticvlm.server.web.lan import new_token
from hapticvlm.server.web.lan_pages import LanPages, own_names

MIN_TOKEN = 12  # characters

PagesFrom = Literal["this-machine", "lan"]


@dataclass(frozen=True, slots=True)
class Address:
    """The address to listen on and the rules of admission; off loopback a token is needed.

    Browsers are served the files of `scene_folder`, if one is given, like all pages: those of this
    machine, or with the token those of the local network. With a certificate everything is
    encrypted: wss and https. `tunnels` are names of programs that pass requests of strangers on to
    this machine as their own, so that these need the token on loopback, too.
    """

    host: str = "127.0.0.1"
    port: int = 8790
    token: str | None = None
    allowed_origins: frozenset[str] = frozenset()
    scene_folder: Path | None = None
    certificate: Certificate | None = None
    pages_from: PagesFrom = "this-machine"
    tunnels: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        require_address(self.host)
        self._check_names()
        self._check_token()
        if self.scene_folder is not None and not self.scene_folder.is_dir():
            raise ValueError(
                f"--scene {self.scene_folder}: no folder of this name; give one with index.html"
            )
        if self.pages_from == "lan" and is_loopback(self.host):
            raise ValueError(
                f"--pages-from lan has no effect while listening on {self.host}: add --host 0.0.0.0"
            )

    def _check_names(self) -> None:
        """Refuse what no request can have as its origin or its host."""
        for origin in self.allowed_origins:
            if not re.fullmatch(r"null|[^/]+://[^/]+", origin):
                raise ValueError(
                    f"--allow-origin {origin}: no origin; give one such as https://example.org"
                )
        for name in self.tunnels:
            if "/" in name:
                raise ValueError(f"--allow-host {name}: no name; give one such as example.org")

    def _check_token(self) -> None:
        """Refuse an empty token anywhere, and a missing or short one off loopback."""
        if self.token == "":
            raise ValueError("--token: empty; leave it out on this machine, or give a secret")
        if is_loopback(self.host) and not self.tunnels:
            return
        if self.token is None and self.tunnels:
            name = min(self.tunnels)
            raise ValueError(
                f"--allow-host {name} lets in who reaches that name: add a token, such as "
                f"--token {new_token()}"
            )
        if self.token is None:
            raise ValueError(
                f"--host {self.host} can be reached from other machines: add a token, such as "
                f"--token {new_token()}, or start `hapticvlm serve --lan`, which makes one"
            )
        if len(self.token) < MIN_TOKEN:
            raise ValueError(
                f"--token: {len(self.token)} characters can be guessed; off this machine it needs "
                f"{MIN_TOKEN} characters or more, such as --token {new_token()}"
            )

    def policy(self) -> http.AccessPolicy:
        """Return the rules by which requests are admitted."""
        lan_pages = None
        certified = () if self.certificate is None else self.certificate.names
        if self.pages_from == "lan" and self.token is not None:
            scheme = "http" if self.certificate is None else "https"
            lan_pages = LanPages(self.token, own_names(certified), scheme)
        names = own_names(certified) | http.hosts_of(self.allowed_origins)
        return http.AccessPolicy(
            self.host,
            self.allowed_origins,
            self.scene_folder,
            lan_pages,
            names,
            self.token,
            tunnels=self.tunnels,
        )
