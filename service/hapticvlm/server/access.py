"""Where the service listens and whom it lets in; what would be unsafe is refused here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from hapticvlm.server import http
from hapticvlm.server.certificate import Certificate
from hapticvlm.server.lan_pages import LanPages, own_names

MIN_TOKEN = 12  # characters: a browser is told "wrong" a thousand times a second

PagesFrom = Literal["this-machine", "lan"]


@dataclass(frozen=True, slots=True)
class Address:
    """Where to listen and whom to let in; a token is needed off loopback.

    Browsers are served the files of `scene_folder`, if one is given, like all pages: those of this
    machine, or with the token those of the local network. With a certificate everything is
    encrypted: wss and https.
    """

    host: str = "127.0.0.1"
    port: int = 8790
    token: str | None = None
    allowed_origins: frozenset[str] = frozenset()
    scene_folder: Path | None = None
    certificate: Certificate | None = None
    pages_from: PagesFrom = "this-machine"

    def __post_init__(self) -> None:
        if self.token is None and not http.is_loopback(self.host):
            raise ValueError(
                f"--host {self.host} can be reached from other machines: add --token SECRET"
            )
        if self.scene_folder is not None and not self.scene_folder.is_dir():
            raise ValueError(f"--scene {self.scene_folder}: no such folder")
        if self.pages_from == "lan":
            self._check_lan()

    def _check_lan(self) -> None:
        if http.is_loopback(self.host):
            raise ValueError(f"--pages-from lan: nobody reaches {self.host}: add --host 0.0.0.0")
        if self.token is None or len(self.token) < MIN_TOKEN:
            raise ValueError(
                f"--pages-from lan: pages need a token that cannot be guessed: {MIN_TOKEN} "
                "characters or more"
            )

    def policy(self) -> http.AccessPolicy:
        """Say who is let in, and to what."""
        lan_pages = None
        if self.pages_from == "lan" and self.token is not None:
            certified = () if self.certificate is None else self.certificate.names
            scheme = "http" if self.certificate is None else "https"
            lan_pages = LanPages(self.token, own_names(certified), scheme)
        return http.AccessPolicy(self.host, self.allowed_origins, self.scene_folder, lan_pages)
