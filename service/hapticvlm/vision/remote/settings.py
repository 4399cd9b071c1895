"""Where a shared recogniser is and how it may be asked. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hapticvlm.vision.remote.contract import SHIPPED, Format

if TYPE_CHECKING:
    from hapticvlm.http_client import Address


FLAG = "--recogniser-url"
REMOTE_SHARE = 0.75  # of the deadline; the rest is for the embedded encoder: our choice


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """What to ask. A crop has an answer within `deadline_s`, remote or local.

    `hash`: the identity it must have, None = whichever it reports. `may_be_clear`: plain http may
    leave this machine.
    """

    url: str
    token: str | None = field(default=None, repr=False)
    gallery: str = SHIPPED
    hash: str | None = None
    deadline_s: float = 0.2
    format: Format = "rgba8"
    may_be_clear: bool = False

    @property
    def remote_s(self) -> float:
        """How long the other machine has, s."""
        return REMOTE_SHARE * self.deadline_s

    def address(self) -> Address:
        """Return where it is, checked with the token. Raises HttpError."""
        from hapticvlm import http_client  # TLS, for those alone who ask elsewhere

        address = http_client.read_address(self.url, FLAG)
        if not (address.is_encrypted or address.is_loopback or self.may_be_clear):
            text = f"{FLAG}: pictures would travel in clear text to {address.name}: use https"
            raise http_client.HttpError(f"{text}, or allow it with --recogniser-clear-text")
        http_client.check_token(self.token, address, FLAG)
        return address


@dataclass(frozen=True, slots=True)
class RemoteState:
    """Whether crops are sent; why not ("": not tried yet); to what; crops answered there and here.

    `failed` counts crops and probes without an answer of use.
    """

    is_used: bool
    reason: str
    identity: str
    answered: int
    failed: int
    local: int
