"""Presents trials one after the other, takes their answers and ratings, and records both.

Two things have to happen in a trial, in either order: the pattern plays to its end, and the
participant answers. The answer may come while the pattern still plays, from its first stroke on.
Each is written to the disk when it happens: `presented`, `answered`, `played`, `rated`. When the
devices fail or the speaker plays nothing, `spoiled` is written with the reason. A spoiled trial
without an answer is presented again; one with an answer is kept and left out of the statistics,
since repeating it would give the participant a second chance at the same trial.
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

MAX_SEEN_MS = 86_400_000.0  # a day; a page that reports more has not measured it
Step = Literal["asking", "resting", "rating"]


@dataclass(slots=True)
class _OpenTrial:
    """The trial that waits for its answer.

    `head` is what its events have in common, `onset` when its first stroke began in s (None
    before), `answered` a future that is done once the answer is recorded.
    """

    head: Event
    answered: asyncio.Future[None]
    onset: float | None = None


class Trials:
    """Presents trials and takes their answers; calls `enter` at each step of a trial."""

    def __init__(self, record: Record, player: Player, enter: Callable[[Step], None]) -> None:
        self._record = record
        self._player = player
        self._enter = enter
        self._open: _OpenTrial | None = None
        self._rated: asyncio.Future[None] | None = None

    async def present(self, progress: ParticipantProgress, name: str) -> None:
        """Present the next trial and return once it is played and answered.

        Raises PresentationError when the devices could not present it, and StudyError when it could
        not be recorded. May be cancelled at any time; the trial is then recorded as spoiled.
        """
        head = {"trial": progress.answered, "pattern": name, "attempt": progress.attempts + 1}
        self._record.note({"event": "presented", **head})
        self._open = trial = _OpenTrial(head, asyncio.get_running_loop().create_future())
        stimulus = self._record.design.stimulus(name)
        playing = asyncio.create_task(self._player.play(stimulus, self._onset))
        try:
            # An error of the player ends the wait at once, answered or not; otherwise it lasts
            # until both are done.
            both: set[asyncio.Future[Any]] = {playing, trial.answered}
            await asyncio.wait(both, return_when=asyncio.FIRST_EXCEPTION)
            self._record.note({"event": "played", **head, **asdict(playing.result())})
        except (asyncio.CancelledError, PresentationError) as error:
            self._record.note({"event": "spoiled", **head, "why": str(error) or "interrupted"})
            raise
        finally:
            # From here on no answer is taken. The player has to end before this returns, since it
            # still moves the hand that the next trial will use.
            self._open = None
            playing.cancel()
            with contextlib.suppress(asyncio.CancelledError, PresentationError):
                await playing

    def answer(self, trial: int, name: str, seen_ms: object) -> None:
        """Record the answer to the open trial, given `seen_ms` after the page showed the question.

        Raises StudyError for a second answer, one to another trial, or an unknown pattern.
        """
        opened = self._open
        self._record.design.stimulus(name)
        if opened is None or opened.onset is None or opened.answered.done():
            raise StudyError("no trial is open")
        # The page names the trial: a key pressed twice must not answer the next one.
        if trial != opened.head["trial"]:
            raise StudyError("that trial is over")
        self._record.note(
            {
                "event": "answered",
                **opened.head,
                "answered": name,
                "reaction_s": round(time.monotonic() - opened.onset, 4),
                "seen_ms": _milliseconds(seen_ms),
            }
        )
        opened.answered.set_result(None)
        self._enter("resting")

    async def wait_for_rating(self) -> None:
        """Return once the pattern just answered is rated."""
        self._rated = asyncio.get_running_loop().create_future()
        self._enter("rating")
        try:
            await self._rated
        finally:
            self._rated = None

    def rate(self, trial: int, ratings: dict[str, Any]) -> None:
        """Record the ratings of the trial just answered. Raises StudyError."""
        progress = self._record.progress
        if self._rated is None or progress is None or trial != progress.to_rate:
            raise StudyError("no rating is open")
        checked = self._record.design.form.ratings(ratings)
        pattern = progress.trials[trial]
        event = {"event": "rated", "trial": trial, "pattern": pattern, "ratings": checked}
        self._record.note(event)
        self._rated.set_result(None)

    def _onset(self) -> None:
        if self._open is not None:
            self._open.onset = time.monotonic()
            self._enter("asking")


def _milliseconds(seen: object) -> float | None:
    """Return a time that a page measured, ms; None where it is not a possible one."""
    if isinstance(seen, bool) or not isinstance(seen, int | float) or not 0 <= seen <= MAX_SEEN_MS:
        return None
    return float(seen)
