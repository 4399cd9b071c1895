"""Guides one participant after the other through a study. Knows no socket.

It is a state machine whose state is `phase`. A participant passes through

    choosing -> consent -> questions -> training -> ready
             -> (resting -> playing -> asking [-> rating]) for each trial
             -> questions -> done

where steps that the study does not have are left out. `paused`, `stopped` and `trouble` can be
entered from anywhere between training and the last trial, and `begin` leads back.

Only the phases from resting to rating, and a pattern that plays in training, depend on a running
task (`_work`). Where a participant stands otherwise (`_standing`) is derived from the events on the
disk and from nothing else.
So a pause, a fault or a crash at any moment loses no more than the trial that was open, and that
trial is presented again: it counts only once its answer is on the disk.

A page sends commands (`do`) and is sent everything in one `view`, which never names the pattern of
an open trial. The caller runs one command at a time.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
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

ANSWER_S = 3.0  # assumed for an answer until the participant's own pace is known; our choice


class Conductor:
    """The present state of a study; calls `notify` whenever the view has changed."""

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
        """Return what the participant's page shows now, as a map for JSON."""
        shown: View = {
            "phase": self.phase,
            "patterns": [stimulus.described() for stimulus in self._design.stimuli],
            "participants": self._record.participants(),
            "devices": self._player.devices,
            "masking_noise": self._pace.masking_noise,
            "hear": self._pace.hear,
            "renderings_wanted": self._design.renderings,
            "minutes": math.ceil(self._whole_s() / 60),
            "trouble": self._trouble,
            "busy": self._work is not None,
        }
        if self._record.progress is not None:
            # In training the page marks the pattern that plays; in a trial its name is the answer.
            feeling = self._playing if self.phase == "training" else None
            shown |= {**self._record.view(), "feeling": feeling}
            shown["seconds_left"] = self._seconds_left(self._record.progress)
        return shown

    def _whole_s(self) -> float:
        """Return about how long a participant's training and trials take together, s."""
        times = self._design.renderings + self._design.repeats
        each_s = (times * (s.lead_s + s.seconds + self._pace.rest_s) for s in self._design.stimuli)
        answers = self._design.repeats * len(self._design.stimuli)
        return sum(each_s) + answers * ANSWER_S

    def _seconds_left(self, progress: ParticipantProgress) -> float:
        """Return about how long the training still takes, and after it the remaining trials, s."""
        if not progress.is_trained:
            wanted = self._design.renderings
            stimuli = self._design.stimuli
            due = {each.name: max(0, wanted - progress.renderings[each.name]) for each in stimuli}
            each_s = (due[s.name] * (s.lead_s + s.seconds + self._pace.rest_s) for s in stimuli)
            return sum(each_s)
        if progress.seconds_left is not None:
            return progress.seconds_left
        remaining = [self._design.stimulus(name) for name in progress.trials[progress.answered :]]
        return sum(s.lead_s + s.seconds + self._pace.rest_s + ANSWER_S for s in remaining)

    def overview(self) -> View:
        """Return what the experimenter's page shows now: the view, the open trial, the outputs."""
        return {**self.view(), **self._record.overview(), "outputs": self._player.outputs}

    async def do(self, command: dict[str, Any]) -> None:
        """Carry out a page's command. Raises StudyError when it is not possible in this phase."""
        match command:
            case {"do": "choose", "participant": str(code)}:
                await self._choose(code)
            case {"do": "pause"}:
                await self._rest("paused")
            case {"do": "stop"}:
                # The outputs first: everything else waits until they rest.
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
                raise StudyError("this page belongs to another version; reload it")

    async def leave(self) -> None:
        """Close the participant's file; the session can be resumed at any time."""
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
        """Return the phase that the events on the disk lead to."""
        progress = self._record.progress
        return "choosing" if progress is None else progress.stage

    def _agree(self, language: str) -> None:
        if self.phase != "consent" or language not in self._design.form.languages:
            raise StudyError("there is nothing to agree to now")
        self._record.note({"event": "agreed", "language": language})
        self.phase = self._standing()

    def _record_answers(self, answers: dict[str, Any]) -> None:
        progress = self._record.progress
        if self.phase != "questions" or progress is None:
            raise StudyError("no question is open")
        when = progress.questions
        checked = self._design.form.answers(when, answers)
        self._record.note({"event": "told", "when": when, "answers": checked})
        self.phase = self._standing()

    def _train(self, name: str) -> None:
        self._design.stimulus(name)
        if self.phase != "training" or self._work is not None:
            raise StudyError("patterns can be played in training only, one at a time")
        self._work = asyncio.create_task(self._guard(self._render(name)))

    async def _render(self, name: str) -> None:
        """Play one pattern of the training."""
        self._playing = name
        self.notify()
        played = await self._player.play(self._design.stimulus(name), lambda: None)
        self._record.note({"event": "felt", "pattern": name, **asdict(played)})
        self._playing = None
        self.notify()
        await self._player.settle(self._pace.rest_s, self._pace.settle_s)

    def _begin(self) -> None:
        """Start or continue the trials, or go back to the training that was interrupted."""
        progress = self._record.progress
        is_in_trouble = self.phase == "trouble"
        if progress is None or self._work is not None or (progress.is_done and not is_in_trouble):
            raise StudyError("there is nothing to begin now")
        if progress.is_done:
            # The devices failed after the last answer. There is nothing left to present, but the
            # participant still has to get to the questions at the end.
            self._trouble = None
            self.phase = self._standing()
            return
        if progress.stage in ("consent", "questions"):
            raise StudyError("answer the questions that are asked first")
        if not progress.is_trained:
            if self.phase in ("paused", "stopped", "trouble"):
                self.phase = "training"
                self._trouble = None
                return
            if progress.next_to_feel is not None:
                raise StudyError("feel every pattern first, as often as the study asks")
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
        """Cancel what plays and wait for its end."""
        # `_work` is cleared before waiting: a command that comes meanwhile must not find a task
        # that is about to end and take it for one that runs.
        work = self._work
        self._work = None
        self._playing = None
        if work is not None:
            work.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await work

    async def _guard(self, work: Coroutine[Any, Any, None]) -> None:
        """Run `work`; a failure of devices or disk becomes the phase `trouble`."""
        try:
            await work
        except (PresentationError, StudyError) as error:
            self._trouble = str(error)
            self._enter("trouble")
        finally:
            self._playing = None
            # Unless this task was cancelled and another one was started in its place.
            if self._work is asyncio.current_task():
                self._work = None
        self.notify()

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self.notify()
