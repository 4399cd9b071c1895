"""Sends an owner that asks for it the vibration of the hands: plans of the next tenth of a second.

Idle until an owner asks. Then the commands that go to the speaker go to planners of the same voices
too, and every PLAN_EVERY_S each hand that vibrates gets a plan, at once at an onset. When a hand
stops vibrating, by a release, the end of its lease, a stop or a fault, one empty plan follows at
once. Planners are made in a thread, since filling their caches would hold up touches, and as soon
as the service runs: a scene that asks and touches at once would feel nothing for a second.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from msgspec.structs import replace

from hapticvlm.devices.speaker import table_cache
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.messages import FeelForm, Transient, Vibration
from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, VibrationPlan, VibrationPlanner
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.actions import Action, PlayVibration, ReleaseHand, SetGain
from hapticvlm.session.hands import NAMES

PLAN_EVERY_S = 0.035  # with ticks of 20 ms one plan in 40 ms: two reach a client in a horizon

Post = Callable[[Vibration], None]
Forms = tuple[FeelForm | None, ...]


class VibrationEvents:
    """The planners of both hands, and the receiver of their plans."""

    def __init__(self, speaker: Speaker) -> None:
        self._speaker = speaker
        self._forms: Forms = (None, None)
        self._post: Post | None = None
        self.is_on = False  # whether anybody asked for events
        self._planners: tuple[VibrationPlanner, ...] = ()
        self._is_vibrating = [False, False]
        self._planned_at = [0.0, 0.0]
        self._making: asyncio.Future[tuple[VibrationPlanner, ...]] | None = None
        self._missed: dict[int, Command] = {}  # of each hand the newest, while planners are made

    def prepare(self) -> None:
        """Make the planners, in a thread, unless they are made or being made."""
        if not self._planners and self._making is None:
            # The planners are made in a thread and handed over on the loop (`_made`). The thread
            # shares nothing while it works: it reads settings, which are frozen, and returns what
            # it made. So no planner is ever seen half made, and none is touched by two threads.
            self._making = asyncio.get_running_loop().run_in_executor(None, self._make)
            self._making.add_done_callback(self._made)

    def subscribe(self, forms: Forms, post: Post) -> None:
        """Send plans in these forms (left, right) to `post` from now on; None = none."""
        self._forms = forms
        if not any(forms):
            self.end()
            return
        self._post = post
        self.is_on = True
        for planner in self._planners:
            planner.gain = self._speaker.settings.gain
        self.prepare()

    def end(self) -> None:
        """Send nothing any more."""
        self._post = None
        self.is_on = False
        self._missed.clear()
        for planner in self._planners:
            planner.rest()
        self._is_vibrating = [False, False]

    def drive(self, action: Action) -> None:
        """Follow the command just sent to the speaker."""
        match action:
            case SetGain():
                for planner in self._planners:
                    planner.gain = action.gain
            case ReleaseHand():
                self._missed.pop(action.hand, None)
                self._silence(action.hand)
            case PlayVibration(command) if not self._planners:
                # Until the planners are there the newest command of each hand is kept. A slide goes
                # on from it when they are; a blow is left out then, since it is over and would be
                # felt as another one.
                self._missed[command.hand] = command
            case PlayVibration(command) if self._planners:
                planner = self._planners[command.hand]
                now = time.monotonic()
                planner.apply(command, now)
                if command.onset:  # at once, but not before the touch is answered
                    # `call_soon` puts the planning behind what this turn of the loop still does,
                    # the reply to the touch among it: the client gets the reply before the plan.
                    asyncio.get_running_loop().call_soon(self._send, command.hand, now)

    def stop(self) -> None:
        """Silence both hands and report that a stop holds them."""
        self._missed.clear()
        for hand in range(len(NAMES)):
            self._silence(hand, stopped=True)

    def rest(self) -> None:
        """Silence both hands."""
        self._missed.clear()
        for hand in range(len(NAMES)):
            self._silence(hand)

    def tick(self, now: float) -> None:
        """Send each hand its next plan when it is due."""
        for hand in range(len(NAMES)):
            if now - self._planned_at[hand] >= PLAN_EVERY_S:
                self._send(hand, now)

    def _send(self, hand: int, now: float) -> None:
        form = self._forms[hand]
        if self._post is None or form is None or not self._planners:
            return
        self._planned_at[hand] = now
        plan = self._planners[hand].plan(form, now)
        was_vibrating, self._is_vibrating[hand] = self._is_vibrating[hand], bool(plan.amplitude)
        if plan.amplitude or was_vibrating:
            self._post(_event(hand, plan))

    def _silence(self, hand: int, *, stopped: bool = False) -> None:
        was_vibrating, self._is_vibrating[hand] = self._is_vibrating[hand], False
        if self._planners:
            self._planners[hand].rest()
        form = self._forms[hand]
        if self._post is not None and form is not None and (was_vibrating or stopped):
            self._post(_event(hand, VibrationPlan(PERIOD_S[form]), stopped=stopped))

    def _make(self) -> tuple[VibrationPlanner, ...]:
        settings = self._speaker.settings
        table = {material.name: material for material in settings.materials}
        table_cache.load(CACHE)  # what the engine computed at its start is not computed here again
        return tuple(VibrationPlanner(table, settings.patterns, settings.gain) for _ in NAMES)

    def _made(self, making: asyncio.Future[tuple[VibrationPlanner, ...]]) -> None:
        if not making.cancelled():
            self._planners = making.result()
            for planner in self._planners:
                planner.gain = self._speaker.settings.gain
            self._catch_up(time.monotonic())

    def _catch_up(self, now: float) -> None:
        """Go on with what the hands do already; a blow that is over by now is not made up for."""
        # Only what goes on is taken up. The onset is left out, since that blow was a second ago; a
        # renewal of the same touch would bring it anyway, but a hand that presses without moving
        # renews slowly.
        for hand, command in self._missed.items():
            self._planners[hand].apply(replace(command, onset=False), now)
        self._missed.clear()


def _event(hand: int, plan: VibrationPlan, *, stopped: bool = False) -> Vibration:
    return Vibration(
        id=0,
        hand=NAMES[hand],
        period_ms=1000.0 * plan.period_s,
        amplitude=list(plan.amplitude),
        frequency_hz=list(plan.frequency_hz),
        transients=[
            Transient(
                at_ms=1000.0 * pulse.at_s,
                amplitude=pulse.amplitude,
                frequency_hz=pulse.frequency_hz,
            )
            for pulse in plan.pulses
        ],
        stopped=stopped,
    )
