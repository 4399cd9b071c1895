"""How a shared recogniser stands, as the local one reports it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RemoteState:
    """Whether looks are sent; why not ("": not tried yet); to what; looks answered there and here.

    `failed` counts looks and probes without an answer of use.
    """

    is_used: bool
    reason: str
    identity: str
    answered: int
    failed: int
    local: int
