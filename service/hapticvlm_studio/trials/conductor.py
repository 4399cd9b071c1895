"""Leads one participant after the other through a study: what a page asks for, what it may show.

A page is sent everything in one `view`, which never names the pattern of an open trial. Each trial
rests, plays and waits for the answer; pause, stop and trouble leave it unanswered, so it is
presented again. Knows no socket.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import Callable, Coroutine
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from hapticvlm import __version__
from hapticvlm_studio.design.design import Design
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.player import Player, PresentationError
from hapticvlm_studio.trials.progress import ParticipantProgress
from hapticvlm_studio.trials.record import Pace, Record, View
from hapticvlm_studio.trials.trial import Trials

Phase = Literal[
    "choosing", "consent", "questions", "training", "ready", "resting", "playing", "asking",
    "rating", "paused", "stopped", "trouble", "done",
]  # fmt: skip

ANSWER_S = 3.0  # of a participant whose own pace is not known yet


class Conductor:
    """The study's present state; `notify` is called whenever the view has changed."""

    def __init__(self, design: Design, folder: Path, player: Player, pace: Pace) -> None:
        self.notify: Callable[[], None] = lambda: None
        self.phase: Phase = "choosing"
        self._design = design
        self._player = player
        self._pace = pace
        self._record = Record(design, folder)
        self._trials = Trials(self._record, player, self._enter)
        self._work: asyncio.Task[None] | None = None
        self._playing: str | None = None
        self._trouble: str | None = None
        self._run = secrets.token_hex(4)

    def view(self) -> View:
        """Describe what a page shows now."""
        shown: View = {
            "phase": self.phase,
            "patterns": [stimulus.described() for stimulus in self._design.stimuli],
            "participants": self._record.participants(),
            "devices": self._player.devices,
            "masking_noise": self._pace.masking_noise,
            "hear": self._pace.hear,
            "renderings_wanted": self._design.renderings,
            "trouble": self._trouble,
            "busy": self._work is not None,
        }
        if self._record.progress is not None:
            feeling = self._playing if self.phase == "training" else None
            shown |= {**self._record.view(), "feeling": feeling}
            shown["seconds_left"] = self._seconds_left(self._record.progress)
        return shown

    def _seconds_left(self, progress: ParticipantProgress) -> float:
        """Return about how long the remaining trials take: by one's own pace once it shows."""
        if progress.seconds_left is not None:
            return progress.seconds_left
        left = [self._design.stimulus(name) for name in progress.trials[progress.answered :]]
        return sum(s.lead_s + s.seconds + self._pace.rest_s + ANSWER_S for s in left)

    def overview(self) -> View:
        """Describe what the experimenter's page shows now."""
        return {**self.view(), **self._record.overview(), "outputs": self._player.outputs}

    async def do(self, command: dict[str, Any]) -> None:
        """Carry out what a page asks for. Raises StudyError when it cannot be asked now."""
        match command:
            case {"do": "choose", "participant": str(code)}:
                await self._choose(code)
            case {"do": "pause"}:
                await self._rest("paused")
            case {"do": "stop"}:
                await self._player.stop()
                await self._rest("stopped")
            case {"do": "leave"}:
                await self.leave()
            case _:
                self._do_at_once(command)
        self.notify()

    def _do_at_once(self, command: dict[str, Any]) -> None:
        match command:
            case {"do": "feel", "pattern": str(name)}:
                self._train(name)
            case {"do": "begin"}:
                self._begin()
            case {"do": "answer", "trial": int(trial), "pattern": str(name)}:
                self._trials.answer(trial, name, command.get("seen_ms"))
            case {"do": "rate", "trial": int(trial), "ratings": dict(ratings)}:
                self._trials.rate(trial, ratings)
            case {"do": "agree", "language": str(language)}:
                self._agree(language)
            case {"do": "tell", "answers": dict(answers)}:
                self._record_answers(answers)
            case {"do": "masking", "on": bool(on)}:
                self._record.note({"event": "masking", "on": on})
            case _:
                raise StudyError("this page is of another version; reload it")

    async def leave(self) -> None:
        """End the session for now; it can be resumed at any time."""
        await self._cease()
        self._record.close()
        self._trouble = None
        self.phase = "choosing"

    async def _choose(self, code: str) -> None:
        if code not in self._design.trials:
            raise StudyError(f"no participant {code!r}")
        await self.leave()
        self._record.open(code)
        opening = {"run": self._run, "version": __version__, "devices": self._player.devices}
        self._record.note({"event": "opened", **opening, **self._pace.noted()})
        self.phase = self._standing()

    def _standing(self) -> Phase:
        """Return the phase of a participant who does nothing just now."""
        progress = self._record.progress
        return "choosing" if progress is None else progress.stage

    def _agree(self, language: str) -> None:
        if self.phase != "consent" or language not in self._design.form.languages:
            raise StudyError("there is nothing to agree to now")
        self._record.note({"event": "agreed", "language": language})
        self.phase = self._standing()

    def _record_answers(self, given: dict[str, Any]) -> None:
        progress = self._record.progress
        if self.phase != "questions" or progress is None:
            raise StudyError("no question is open")
        when = progress.questions
        answers = self._design.form.answers(when, given)
        self._record.note({"event": "told", "when": when, "answers": answers})
        self.phase = self._standing()

    def _train(self, name: str) -> None:
        self._design.stimulus(name)
        if self.phase != "training" or self._work is not None:
            raise StudyError("one pattern at a time, and only in training")
        self._work = asyncio.create_task(self._guard(self._render(name)))

    async def _render(self, name: str) -> None:
        """Play one pattern of training, by its name."""
        self._playing = name
        self.notify()
        played = await self._player.play(self._design.stimulus(name), lambda: None)
        self._record.note({"event": "felt", "pattern": name, **asdict(played)})
        self._playing = None
        self.notify()
        await self._player.settle(self._pace.rest_s, self._pace.settle_s)

    def _begin(self) -> None:
        """Start the trials, or continue them."""
        progress = self._record.progress
        is_in_trouble = self.phase == "trouble"
        if progress is None or self._work is not None or (progress.is_done and not is_in_trouble):
            raise StudyError("there is nothing to begin now")
        if progress.is_done:  # the last pattern met trouble after it was answered
            self._trouble, self.phase = None, self._standing()
            return
        if progress.stage in ("consent", "questions"):
            raise StudyError("answer what is asked first")
        if not progress.is_trained:
            if self.phase in ("paused", "stopped", "trouble"):
                self.phase = "training"
                self._trouble = None
                return
            if progress.next_to_feel is not None:
                raise StudyError("feel every pattern first, as often as asked")
            self._record.note({"event": "trained"})
        self._trouble = None
        self._work = asyncio.create_task(self._guard(self._present_all(progress)))

    async def _present_all(self, progress: ParticipantProgress) -> None:
        while not progress.is_done:
            if progress.to_rate is not None:
                await self._trials.wait_for_rating()
            if (name := progress.next_trial) is None:
                break
            self._enter("resting")
            await self._player.settle(self._pace.rest_s, self._pace.settle_s)
            self._enter("playing")
            await self._trials.present(progress, name)
        self._enter(self._standing())

    async def _rest(self, phase: Phase) -> None:
        progress = self._record.progress
        if progress is None or progress.stage in ("consent", "questions", "done"):
            return
        await self._cease()
        self._record.note({"event": phase})
        self.phase = phase

    async def _cease(self) -> None:
        """End whatever plays, and wait for its end."""
        work = self._work
        self._work = None
        self._playing = None
        if work is not None:
            work.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await work

    async def _guard(self, work: Coroutine[Any, Any, None]) -> None:
        """Carry out work; what goes wrong with devices or disk becomes the phase `trouble`."""
        try:
            await work
        except (PresentationError, StudyError) as trouble:
            self._trouble = str(trouble)
            self._enter("trouble")
        finally:
            self._playing = None
            if self._work is asyncio.current_task():
                self._work = None
        self.notify()

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self.notify()
