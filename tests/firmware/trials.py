"""Runs one trial: a hand on the plate, a persistent host, injected faults, and the outcome.

The host renews its setpoint and repeats HELLO whatever the board answers. The
palm never leaves. A trial ends when no current can flow any more, and then continues for another
minute, in which a hot sink heats the plate through the open module. Where nothing switches off,
the dose is carried on to the session's 15 min.
"""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from multiprocessing import get_context

from hapticvlm.rendering.heat.limits import HEAT_LIMIT_S

from . import line
from .board import Board, Build
from .build import USUAL, Chip
from .faults import SLOW_S, Fault, Guard
from .rawhost import RENEW_S, SWITCHED_ON_S, TTL_S, RawHost
from .situations import BEFORE_S, Situation

SHORT_S, TEST_S, LONG_S = 60.0, 100.0, 300.0  # the sweep runs the long ones
AFTER_S = 60.0
_SURE_S = 1.0
_STEADY_C, _STEADY_S = 0.03, 10.0  # of sink, plate and skin alike


@dataclass(frozen=True)
class Outcome:
    """The outcome of a trial; times in s after the injection, None when it did not happen."""

    faults: tuple[str, ...]
    situation: str
    off_after_s: float | None  # registers of the bridge
    left_after_s: float | None  # the host's setpoint
    cut_out_after_s: float | None
    numbers: tuple[str, ...]
    caught_by: tuple[Guard, ...]
    skin_low_c: float
    skin_high_c: float
    plate_low_c: float
    plate_high_c: float
    sink_high_c: float
    dose_cem43: float
    shoot_through: int

    @property
    def is_safe(self) -> bool:
        """Return whether the skin stayed within the project's limits."""
        return self.skin_low_c >= 13.0 and self.skin_high_c <= 43.0 and self.dose_cem43 <= 0.5


class _Trial:
    """The run of one trial; `longest_s` is for faults that need time to do harm."""

    def __init__(self, board: Board, situation: Situation) -> None:
        self.board, self.situation = board, situation
        self.faults: Sequence[Fault] = ()
        self.host = RawHost(board)
        self.injected_at = self._begun_at = 0.0
        self.left_at: float | None = None
        self._chance = random.Random(1)
        self._safe_since: float | None = None
        self._marked_at, self._marks = 0.0, (0.0, 0.0, 0.0)

    def begin(self, at_start: Sequence[Fault]) -> None:
        """Run until the other faults are injected."""
        for fault in at_start:
            fault.begin(self.board)
        self.host.advance(SWITCHED_ON_S)
        self._begun_at = self.board.now
        self._live(self.situation.faulty_at_s)

    def finish(self, faults: Sequence[Fault], longest_s: float) -> Outcome:
        """Run the rest of the trial."""
        self.faults = faults
        if any(not fault.at_start for fault in faults):
            self.injected_at, self._safe_since = self.board.now, None
        for fault in faults:
            if not fault.at_start:
                fault.begin(self.board)
        slow = any(fault.deadline_s == SLOW_S for fault in faults)
        held_s = self.situation.faulty_at_s - BEFORE_S
        self._live(held_s + (longest_s if slow else min(SHORT_S, longest_s)))
        return self._outcome()

    def _live(self, until_s: float) -> None:
        while (elapsed := self.board.now - self._begun_at) < until_s and not self._is_over():
            if elapsed > self.situation.busy_s and self._is_steady():
                return
            self._speak(elapsed)
            self.host.advance(RENEW_S)
            said = self.host.telemetry
            if said is not None and said.state != "holding" and self.left_at is None:
                self.left_at = self.board.now if self.injected_at else None

    def _speak(self, elapsed_s: float) -> None:
        injected = bool(self.injected_at)
        if injected and any(fault.noise for fault in self.faults):
            self.board.write(self._chance.randbytes(1000))
        if injected and any(fault.silent for fault in self.faults):
            return
        if round(elapsed_s / RENEW_S) % 10 == 0:
            self.host.send(line.HELLO, b"\x01\x00")
        if injected and self._is_switched_off(elapsed_s):
            self.host.send(line.OFF)
            return
        setpoint_c = self.situation.setpoint_c(elapsed_s)
        self.host.send(line.SETPOINT, line.setpoint(setpoint_c, TTL_S))

    def _is_switched_off(self, elapsed_s: float) -> bool:
        every_s = max((fault.off_every_s for fault in self.faults), default=0.0)
        return every_s > 0.0 and round(elapsed_s / RENEW_S) // round(every_s / RENEW_S) % 2 == 1

    def _is_over(self) -> bool:
        said = self.host.telemetry
        stopped = said is not None and said.state in ("faulted", "off")
        dead = self.board.cut_out.is_open or (stopped and not self.board.driver.shorted)
        if not dead or self.board.now < BEFORE_S:
            self._safe_since = None
        elif self._safe_since is None:
            self._safe_since = self.board.now
        return self._safe_since is not None and self.board.now - self._safe_since > _SURE_S

    def _is_steady(self) -> bool:
        if self.board.now - self._marked_at < _STEADY_S:
            return False
        plant, before = self.board.plant, self._marks
        self._marks = (plant.sink_c, plant.plate_c, plant.skin_c)
        self._marked_at = self.board.now
        moved_c = max(abs(now - then) for now, then in zip(self._marks, before, strict=True))
        return moved_c < _STEADY_C

    def _outcome(self) -> Outcome:
        board, said = self.board, self.host.telemetry
        running_on = not self._is_over()
        off_at = None if board.is_driven else board.last_driven_at
        board.rest_of_heat(0.0 if running_on else AFTER_S)
        dose_cem43 = board.skin.dose_cem43
        if running_on:
            dose_cem43 += board.skin.rate(board.plant.skin_c) * max(HEAT_LIMIT_S - board.now, 0.0)
        since = self.injected_at
        return Outcome(
            tuple(fault.name for fault in self.faults),
            self.situation.name,
            _after(off_at, since),
            _after(self.left_at, since),
            _after(board.cut_out_opened_at, since),
            said.faults if said else (),
            self._caught_by(),
            board.skin.lowest_c,
            board.skin.highest_c,
            board.coldest_plate_c,
            board.hottest_plate_c,
            board.hottest_sink_c,
            dose_cem43,
            board.shoot_through,
        )

    def _caught_by(self) -> tuple[Guard, ...]:
        said = self.host.telemetry
        found: list[Guard] = []
        if said is not None and said.state != "holding":
            found.append("firmware")
        if self.board.limited_s:
            found.append("current limit")
        if self.board.cut_out.has_tripped:
            found.append("cut-out")
        return tuple(found)


def trial(
    chip: Chip,
    faults: Sequence[Fault],
    situation: Situation,
    longest_s: float = LONG_S,
    build: Build = USUAL,
) -> Outcome:
    """Run one trial; what comes before the injection runs once for all that begin alike."""
    begun = _begun(chip, build, situation, tuple(fault for fault in faults if fault.at_start))
    rest = partial(begun.finish, faults, longest_s)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the copy needs none of our threads
        with ProcessPoolExecutor(1, get_context("fork"), _rests.append, (rest,)) as copy:
            return copy.submit(_finish).result()


@cache
def _begun(chip: Chip, build: Build, situation: Situation, at_start: tuple[Fault, ...]) -> _Trial:
    """Return a trial that stays where the rest is injected: copies of the process go on."""
    board = chip.board(situation.ambient_c, build=build)
    board.plant.touch(situation.palm_resistance)
    begun = _Trial(board, situation)
    begun.begin(at_start)
    return begun


_rests: list[Callable[[], Outcome]] = []  # in a copy, that of its trial


def _finish() -> Outcome:
    return _rests[0]()


def _after(at: float | None, since: float) -> float | None:
    return None if at is None else max(at - since, 0.0)
