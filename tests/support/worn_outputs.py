"""Waits for what the program of a worn output shows, while a hand goes on."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

from pace import PACE


async def shown(
    claim: Callable[[], object], move: Callable[[], Awaitable[Any]] | None = None
) -> None:
    """Go on moving, if a move is given, until the claim holds."""
    gives_up_at = time.monotonic() + 60.0 * PACE
    while not claim():
        assert time.monotonic() < gives_up_at, "the program shows nothing of it"
        if move is not None:
            await move()
        await asyncio.sleep(0.02)
