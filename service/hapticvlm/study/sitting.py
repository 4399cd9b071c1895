"""How far one participant has come, told by the events of their file. Pure.

Everything is derived from the events, so a sitting that is interrupted anywhere goes on where the
file ends: a trial counts once it is answered, and one that was presented and not answered is
presented again.
"""

from __future__ import annotations

from collections import Counter

from hapticvlm.study.log import Design, Event


class Sitting:
    """One participant's training and trials; feed it every event of the file, in order."""

    def __init__(self, design: Design, participant: str) -> None:
        self.participant = participant
        self.trials = design.trials[participant]
        self.renderings: Counter[str] = Counter()
        self.answered = 0
        self.correct = 0
        self.attempts = 0
        self._names = [stimulus.name for stimulus in design.stimuli]
        self._wanted = design.renderings
        self._is_trained = False

    def take(self, event: Event) -> None:
        """Take in one event."""
        match event["event"]:
            case "felt":
                self.renderings[event["pattern"]] += 1
            case "trained":
                self._is_trained = True
            case "presented":
                self.attempts += 1
            case "answered":
                self.correct += event["pattern"] == event["answered"]
                self.answered += 1
                self.attempts = 0

    @property
    def next_to_feel(self) -> str | None:
        """The pattern felt least often in training so far; None when all were felt enough."""
        due = min(self._names, key=lambda name: self.renderings[name])
        return due if self.renderings[due] < self._wanted else None

    @property
    def is_trained(self) -> bool:
        """Whether training was ended."""
        return self._is_trained

    @property
    def next_trial(self) -> str | None:
        """The pattern to present next; None when all trials are answered."""
        return None if self.is_done else self.trials[self.answered]

    @property
    def is_done(self) -> bool:
        """Whether every trial is answered."""
        return self.answered >= len(self.trials)
