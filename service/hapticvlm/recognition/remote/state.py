"""The state of a shared recogniser, as the local one reports it."""

from __future__ import annotations

from dataclasses import dataclass


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
