"""One trial after the other: each is presented, answered and perhaps rated, and written down.

A trial whose devices failed, or whose speaker played nothing, is noted as spoiled: unanswered, it
is presented again; answered, it is kept and left out of the statistics.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Literal

from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.player import Player, PresentationError
from hapticvlm_studio.trials.progress import Event, ParticipantProgress
from hapticvlm_studio.trials.record import Record

MOST_SEEN_MS = 86_400_000.0  # a day: what is longer was measured by no page
Step = Literal["asking", "resting", "rating"]


@dataclass(slots=True)
class _Asked:
    """The open trial: when its stroke began, and a future that is done once it is answered."""

    head: Event
    answered: asyncio.Future[None]
    onset: float | None = None


class Trials:
    """Presents trials and takes their answers; `enter` is called when it asks and when it rests."""

    def __init__(self, record: Record, player: Player, enter: Callable[[Step], None]) -> None:
        self._record = record
        self._player = player
        self._enter = enter
        self._asked: _Asked | None = None
        self._rated: asyncio.Future[None] | None = None

    async def present(self, progress: ParticipantProgress, name: str) -> None:
        """Present the next trial until it is played and answered. Raises PresentationError."""
        head = {"trial": progress.answered, "pattern": name, "attempt": progress.attempts + 1}
        self._record.note({"event": "presented", **head})
        self._asked = asked = _Asked(head, asyncio.get_running_loop().create_future())
        stimulus = self._record.design.stimulus(name)
        playing = asyncio.create_task(self._player.play(stimulus, self._onset))
        try:
            both: set[asyncio.Future[Any]] = {playing, asked.answered}
            await asyncio.wait(both, return_when=asyncio.FIRST_EXCEPTION)
            self._record.note({"event": "played", **head, **asdict(playing.result())})
        except (asyncio.CancelledError, PresentationError) as error:
            self._record.note({"event": "spoiled", **head, "why": str(error) or "interrupted"})
            raise
        finally:
            self._asked = None
            playing.cancel()
            with contextlib.suppress(asyncio.CancelledError, PresentationError):
                await playing

    def answer(self, trial: int, name: str, seen_ms: object) -> None:
        """Record the answer to the open trial; a second one, or to another trial, is refused."""
        asked = self._asked
        self._record.design.stimulus(name)
        if asked is None or asked.onset is None or asked.answered.done():
            raise StudyError("no trial is open")
        if trial != asked.head["trial"]:
            raise StudyError("that trial is over")
        self._record.note(
            {
                "event": "answered",
                **asked.head,
                "answered": name,
                "reaction_s": round(time.monotonic() - asked.onset, 4),
                "seen_ms": _milliseconds(seen_ms),
            }
        )
        asked.answered.set_result(None)
        self._enter("resting")

    async def wait_for_rating(self) -> None:
        """Wait until the pattern just answered is rated."""
        self._rated = asyncio.get_running_loop().create_future()
        self._enter("rating")
        try:
            await self._rated
        finally:
            self._rated = None

    def rate(self, trial: int, given: dict[str, Any]) -> None:
        """Record the ratings of the trial just answered. Raises StudyError."""
        progress = self._record.progress
        if self._rated is None or progress is None or trial != progress.to_rate:
            raise StudyError("no rating is open")
        ratings = self._record.design.form.ratings(given)
        pattern = progress.trials[trial]
        event = {"event": "rated", "trial": trial, "pattern": pattern, "ratings": ratings}
        self._record.note(event)
        self._rated.set_result(None)

    def _onset(self) -> None:
        if self._asked is not None:
            self._asked.onset = time.monotonic()
            self._enter("asking")


def _milliseconds(seen: object) -> float | None:
    """Return a time that a page measured, ms; None where it is none that can be."""
    if isinstance(seen, bool) or not isinstance(seen, int | float) or not 0 <= seen <= MOST_SEEN_MS:
        return None
    return float(seen)
