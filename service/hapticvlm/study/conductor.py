"""Leads one participant after the other through a study: what a page asks for, what it may show.

A page is told everything by one `view`, which never names the pattern of an open trial. Each trial
rests, plays and waits for the answer; pause, stop and trouble leave it unanswered, so it is
presented again. Knows no socket.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from collections.abc import Callable, Coroutine
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from hapticvlm import __version__
from hapticvlm.study.log import Design, Event, Log, events
from hapticvlm.study.player import Player, Trouble
from hapticvlm.study.sitting import Sitting
from hapticvlm.study.stimuli import StudyError

Phase = Literal[
    "choosing", "training", "ready", "resting", "playing", "asking", "paused", "stopped",
    "trouble", "done",
]  # fmt: skip
View = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Pace:
    """Rest between patterns and the longest wait for the plate, s; whether noise masks sound."""

    rest_s: float = 3.0
    settle_s: float = 60.0
    masking_noise: bool = False


@dataclass(slots=True)
class _Asked:
    """The open trial: when its stroke began, and a future that is done once it is answered."""

    head: Event
    answered: asyncio.Future[None]
    onset: float | None = None


class Conductor:
    """The study's present state; `tell` is called whenever the view has changed."""

    def __init__(self, design: Design, folder: Path, player: Player, pace: Pace) -> None:
        self.tell: Callable[[], None] = lambda: None
        self.phase: Phase = "choosing"
        self._design = design
        self._folder = folder
        self._player = player
        self._pace = pace
        self._sitting: Sitting | None = None
        self._log: Log | None = None
        self._work: asyncio.Task[None] | None = None
        self._asked: _Asked | None = None
        self._playing: str | None = None
        self._trouble: str | None = None
        self._run = secrets.token_hex(4)

    def view(self) -> View:
        """Describe what a page shows now."""
        sitting = self._sitting
        shown: View = {
            "phase": self.phase,
            "patterns": [stimulus.described() for stimulus in self._design.stimuli],
            "participants": [self._progress(code) for code in self._design.participants],
            "devices": self._player.devices,
            "masking_noise": self._pace.masking_noise,
            "renderings_wanted": self._design.renderings,
            "trouble": self._trouble,
            "busy": self._work is not None,
        }
        if sitting is not None:
            training = self.phase == "training"
            shown |= {
                "participant": sitting.participant,
                "answered": sitting.answered,
                "trials": len(sitting.trials),
                "renderings": dict(sitting.renderings),
                "next_to_feel": sitting.next_to_feel,
                "is_trained": sitting.is_trained,
                "feeling": self._playing if training else None,
            }
        return shown

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
        self.tell()

    def _do_at_once(self, command: dict[str, Any]) -> None:
        match command:
            case {"do": "feel", "pattern": str(name)}:
                self._feel(name)
            case {"do": "begin"}:
                self._begin()
            case {"do": "answer", "trial": int(trial), "pattern": str(name)}:
                self._answer(trial, name, command.get("seen_ms"))
            case {"do": "masking", "on": bool(on)}:
                self._note({"event": "masking", "on": on})
            case _:
                raise StudyError("this page is of another version; reload it")

    async def leave(self) -> None:
        """End the sitting, to be gone on with at any time."""
        await self._cease()
        if self._log is not None:
            self._log.close()
        self._log = self._sitting = self._trouble = None
        self.phase = "choosing"

    def _progress(self, code: str) -> View:
        sitting = self._sitting
        if sitting is None or sitting.participant != code:
            sitting = self._recall(code)
        return {"code": code, "answered": sitting.answered, "trials": len(sitting.trials)}

    def _recall(self, code: str) -> Sitting:
        sitting = Sitting(self._design, code)
        for event in events(self._folder, code):
            sitting.take(event)
        return sitting

    async def _choose(self, code: str) -> None:
        if code not in self._design.trials:
            raise StudyError(f"no participant {code!r}")
        await self.leave()
        self._log = Log(self._folder, code)
        self._sitting = self._recall(code)
        said = {"run": self._run, "version": __version__, "devices": self._player.devices}
        self._note({"event": "opened", **said, **asdict(self._pace)})
        self.phase = self._standing()

    def _standing(self) -> Phase:
        """Where a participant is who does nothing just now."""
        if self._sitting is None:
            return "choosing"
        if self._sitting.is_done:
            return "done"
        return "ready" if self._sitting.is_trained else "training"

    def _feel(self, name: str) -> None:
        self._design.stimulus(name)
        if self.phase != "training" or self._work is not None:
            raise StudyError("one pattern at a time, and only in training")
        self._work = asyncio.create_task(self._guard(self._render(name)))

    async def _render(self, name: str) -> None:
        """Play one pattern of training, by its name."""
        self._playing = name
        self.tell()
        played = await self._player.play(self._design.stimulus(name), lambda: None)
        self._note({"event": "felt", "pattern": name, **asdict(played)})
        self._playing = None
        self.tell()
        await self._player.settle(self._pace.rest_s, self._pace.settle_s)

    def _begin(self) -> None:
        """Start the trials, or go on with them."""
        sitting = self._sitting
        if sitting is None or sitting.is_done or self._work is not None:
            raise StudyError("there is nothing to begin now")
        if not sitting.is_trained:
            if self.phase in ("paused", "stopped", "trouble"):
                self.phase = "training"
                self._trouble = None
                return
            if sitting.next_to_feel is not None:
                raise StudyError("feel every pattern first, as often as asked")
            self._note({"event": "trained"})
        self._trouble = None
        self._work = asyncio.create_task(self._guard(self._present_all(sitting)))

    async def _present_all(self, sitting: Sitting) -> None:
        while (name := sitting.next_trial) is not None:
            self._enter("resting")
            await self._player.settle(self._pace.rest_s, self._pace.settle_s)
            self._enter("playing")
            await self._present(sitting, name)
        self._enter("done")

    async def _present(self, sitting: Sitting, name: str) -> None:
        head = {"trial": sitting.answered, "pattern": name, "attempt": sitting.attempts + 1}
        self._note({"event": "presented", **head})
        self._asked = asked = _Asked(head, asyncio.get_running_loop().create_future())
        playing = asyncio.create_task(self._player.play(self._design.stimulus(name), self._onset))
        try:
            both: set[asyncio.Future[Any]] = {playing, asked.answered}
            await asyncio.wait(both, return_when=asyncio.FIRST_EXCEPTION)
            self._note({"event": "played", **head, **asdict(playing.result())})
        except (asyncio.CancelledError, Trouble) as error:
            self._note({"event": "spoiled", **head, "why": str(error) or "interrupted"})
            raise
        finally:
            self._asked = None
            playing.cancel()
            with contextlib.suppress(asyncio.CancelledError, Trouble):
                await playing

    def _onset(self) -> None:
        if self._asked is not None:
            self._asked.onset = time.monotonic()
            self._enter("asking")

    def _answer(self, trial: int, name: str, seen_ms: object) -> None:
        """Take the answer to the open trial; a second one, or one to another trial, is refused."""
        asked, sitting = self._asked, self._sitting
        self._design.stimulus(name)
        if sitting is None or asked is None or asked.onset is None or asked.answered.done():
            raise StudyError("no trial is open")
        if trial != asked.head["trial"]:
            raise StudyError("that trial is over")
        self._note(
            {
                "event": "answered",
                **asked.head,
                "answered": name,
                "reaction_s": round(time.monotonic() - asked.onset, 4),
                "seen_ms": float(seen_ms) if isinstance(seen_ms, int | float) else None,
            }
        )
        asked.answered.set_result(None)
        self._enter("resting")

    async def _rest(self, phase: Phase) -> None:
        if self._sitting is None or self._sitting.is_done:
            return
        await self._cease()
        self._note({"event": phase})
        self.phase = phase

    async def _cease(self) -> None:
        """End whatever plays, and wait for its end."""
        work, self._work = self._work, None
        self._playing = None
        if work is not None:
            work.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await work

    async def _guard(self, work: Coroutine[Any, Any, None]) -> None:
        """Carry out work; what goes wrong with the devices becomes the phase `trouble`."""
        try:
            await work
        except Trouble as trouble:
            self._trouble = str(trouble)
            self._enter("trouble")
        finally:
            self._playing = None
            if self._work is asyncio.current_task():
                self._work = None
        self.tell()

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self.tell()

    def _note(self, event: Event) -> None:
        """Put an event on the disk, then count it."""
        if self._log is None or self._sitting is None:
            raise StudyError("choose a participant first")
        at = datetime.now(UTC).isoformat(timespec="milliseconds")
        stamped = {**event, "at": at, "t_s": round(time.monotonic(), 4)}
        self._log.add(stamped)
        self._sitting.take(stamped)
