"""Settings and state of a shared recogniser: address, token, deadline, counts. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hapticvlm.vision.remote.contract import SHIPPED

if TYPE_CHECKING:
    from hapticvlm.http_client import Address


FLAG = "--recogniser-url"
REMOTE_SHARE = 0.75  # of the deadline; the rest is for the local encoder: our choice


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """The shared recogniser to use; a crop is answered within `deadline_s`, remotely or locally.

    `hash`: the identity it must have; None: any. `may_be_clear`: plain http to another machine is
    allowed.
    """

    url: str
    token: str | None = field(default=None, repr=False)
    gallery: str = SHIPPED
    hash: str | None = None
    deadline_s: float = 0.2
    may_be_clear: bool = False

    @property
    def remote_s(self) -> float:
        """The time that the other machine has, s."""
        return REMOTE_SHARE * self.deadline_s

    def address(self) -> Address:
        """Return its address, after checking it with the token. Raises HttpError."""
        from hapticvlm import http_client  # imports TLS, which only a shared recogniser needs

        address = http_client.read_address(self.url, FLAG)
        if not (address.is_encrypted or address.is_loopback or self.may_be_clear):
            problem = f"{FLAG}: pictures would be sent to {address.name} in clear text"
            raise http_client.HttpError(
                f"{problem}; use https or allow it: --recogniser-clear-text"
            )
        http_client.check_token(self.token, address, FLAG)
        return address


@dataclass(frozen=True, slots=True)
class RemoteState:
    """The state of a shared recogniser.

    `reason`: why crops are not sent ("": not tried yet). `answered` and `local` count the crops
    recognised there and here, `failed` the crops and probes without a usable answer.
    """

    is_used: bool
    reason: str
    identity: str
    answered: int
    failed: int
    local: int
