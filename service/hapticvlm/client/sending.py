"""Sends the lines of a capture to a service at their recorded pace, and counts the answers.

Frames are sent at their recorded times, without waiting for answers; a service that is slower
answers `skipped`. In fast mode the next line is sent as soon as the last one is answered.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from hapticvlm.captures import CENTRE, Capture, Line
from hapticvlm.client.connection import Client, Message

ANSWER_S = 5.0
RENEW_S = 0.04  # 25 touches/s; a lease lasts 250 ms
STROKE = {"speed_mps": 0.1, "force_n": 1.0}  # a palm rubbing slowly, where no touch was recorded


@dataclass(slots=True)
class Outcome:
    """The result of one stream: counts of messages and answers, and how late frames were sent."""

    sent: Counter[str] = field(default_factory=Counter)
    answers: Counter[str] = field(default_factory=Counter)
    unanswered: int = 0
    seconds: float = 0.0
    late_s: float = 0.0


Seen = Callable[[Line, Message], None]


async def stream(client: Client, capture: Capture, *, seen: Seen) -> Outcome:
    """Send every line of the capture; call `seen` with each line and its answer."""
    sending = _Sending(client, seen)
    async with sending.touching(capture.touched is not None):
        lines = capture.lines()
        # A video is decoded in a thread, so that no touch waits for it. A screen that does not
        # change yields no line, and cancelling this task does not end the thread that waits for
        # one: `close` does, else it would wait for ever.
        try:
            while (line := await asyncio.to_thread(next, lines, None)) is not None:
                await sending.follow(line)
        finally:
            capture.close()
    return await sending.finish()


class _Sending:
    """The state of one stream while it is sent."""

    def __init__(self, client: Client, seen: Seen) -> None:
        self._client = client
        self._seen = seen
        self._outcome = Outcome()
        self._waiting: set[asyncio.Future[Message]] = set()
        self._started = time.monotonic()

    async def follow(self, line: Line) -> None:
        """Send one line at its time."""
        fields = line.message()
        due = self._started + line.t_s
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        self._outcome.late_s = max(self._outcome.late_s, time.monotonic() - due)
        if "captured_at" in fields:
            fields["captured_at"] = due
        await self._send(line, fields)

    @asynccontextmanager
    async def touching(self, is_touched: bool) -> AsyncIterator[None]:
        """Touch the middle of the picture, in real time, until the context ends."""
        if not is_touched:
            yield
            return
        renewing = asyncio.create_task(self._renew_touch())
        try:
            yield
        finally:
            renewing.cancel()
            await asyncio.wait({renewing})
            # a lost link is reported by the frames
            _ = renewing.cancelled() or renewing.exception()
        await self._touch("release")

    async def finish(self) -> Outcome:
        """Wait up to ANSWER_S for the answers that are due, and return the result."""
        if self._waiting:
            await asyncio.wait(self._waiting, timeout=ANSWER_S)
        await asyncio.sleep(0)
        self._outcome.unanswered = len(self._waiting)
        self._outcome.seconds = time.monotonic() - self._started
        return self._outcome

    async def _renew_touch(self) -> None:
        await self._touch("contact")
        while True:
            await asyncio.sleep(RENEW_S)
            await self._touch("slide")

    async def _touch(self, phase: str) -> None:
        now = time.monotonic()
        fields = {"phase": phase, "hand": "right", "object_id": CENTRE, **STROKE}
        line = Line(now - self._started, "touch", fields)
        await self._send(line, {**fields, "captured_at": now})

    async def _send(self, line: Line, fields: dict[str, Any]) -> None:
        future = await self._client.send(line.type, **fields)
        self._outcome.sent[line.type] += 1
        self._waiting.add(future)
        future.add_done_callback(partial(self._keep, line))

    def _keep(self, line: Line, future: asyncio.Future[Message]) -> None:
        self._waiting.discard(future)
        if future.cancelled() or future.exception() is not None:
            return
        answer = future.result()
        reason = answer.get("reason") or answer.get("code")
        self._outcome.answers[answer["type"] + (f" {reason}" if reason else "")] += 1
        self._seen(line, answer)
