"""Derives how far one participant has come from the events of their file. Pure.

The progress is a fold over the events and holds nothing else. So a session that was interrupted
anywhere continues where its file ends: reading the file again gives the state at the last event.
The position in the list of trials is the number of answers; a trial that was presented and not
answered does not advance it and is presented again.
"""

from __future__ import annotations

from collections import Counter, deque
from itertools import pairwise
from statistics import median
from typing import Any, Literal

from hapticvlm_studio.design.design import Design

Event = dict[str, Any]
Stage = Literal["consent", "questions", "training", "ready", "done"]
_RECENT = 10  # answers that are shown, and from which the pace is estimated


class ParticipantProgress:
    """One participant's training and trials; `apply` takes every event of the file, in order."""

    def __init__(self, design: Design, participant: str) -> None:
        self.participant = participant
        self.trials = design.trials[participant]
        self.renderings: Counter[str] = Counter()
        self.answered = 0
        self.correct = 0
        self.attempts = 0
        self.to_rate: int | None = None  # trial whose pattern is to be rated
        self.language = design.form.languages[0]
        self._form = design.form
        self._has_agreed = not design.form.has_welcome
        self._answered_forms = {when for when in ("begin", "end") if not design.form.asks(when)}
        self.recent: deque[Event] = deque(maxlen=_RECENT)  # answers, the newest last
        self._answered_at: deque[float] = deque(maxlen=_RECENT)
        self._names = [stimulus.name for stimulus in design.stimuli]
        self._wanted = design.renderings
        self._is_trained = False

    def apply(self, event: Event) -> None:
        """Apply one event; kinds that do not change the progress are ignored."""
        match event["event"]:
            case "opened":
                # The break since the last session says nothing about the pace, and `t_s` of another
                # session cannot be compared.
                self._answered_at.clear()
            case "agreed":
                self._has_agreed = True
                self.language = event["language"]
            case "told":
                self._answered_forms.add(event["when"])
            case "felt":
                self.renderings[event["pattern"]] += 1
            case "trained":
                self._is_trained = True
            case _:
                self._apply_trial(event)

    def _apply_trial(self, event: Event) -> None:
        match event["event"]:
            case "presented":
                self.attempts += 1
            case "answered":
                self.correct += event["pattern"] == event["answered"]
                self.to_rate = self._rating_due()
                self._answered_at.append(event.get("t_s", 0.0))
                self.recent.append(event)
                self.answered += 1
                self.attempts = 0
            case "rated":
                self.to_rate = None

    def _rating_due(self) -> int | None:
        is_due = self._form.is_rated(self.answered, len(self.trials), len(self._names))
        return self.answered if is_due else None

    @property
    def stage(self) -> Stage:
        """The next step of this participant."""
        if not self._has_agreed:
            return "consent"
        if "begin" not in self._answered_forms:
            return "questions"
        if not self._is_trained:
            return "training"
        if not self.is_done:
            return "ready"
        return "done" if "end" in self._answered_forms else "questions"

    @property
    def questions(self) -> str:
        """The questions that are open at the stage `questions`."""
        return "end" if "begin" in self._answered_forms else "begin"

    @property
    def seconds_left(self) -> float | None:
        """About how long the remaining trials take, s; None before two answers of this session."""
        if len(self._answered_at) < 2:
            return None
        # The median, since one long break among the answers must not count as the pace.
        each_s = median(later - earlier for earlier, later in pairwise(self._answered_at))
        return each_s * (len(self.trials) - self.answered)

    @property
    def next_to_feel(self) -> str | None:
        """The pattern played least often in training; None when all were played often enough."""
        due = min(self._names, key=lambda name: self.renderings[name])
        return due if self.renderings[due] < self._wanted else None

    @property
    def is_trained(self) -> bool:
        """Whether the training is over."""
        return self._is_trained

    @property
    def next_trial(self) -> str | None:
        """The pattern to present next; None when all trials are answered."""
        return self.trials[self.answered] if self.answered < len(self.trials) else None

    @property
    def is_done(self) -> bool:
        """Whether every trial is answered and, where required, rated."""
        return self.next_trial is None and self.to_rate is None
