"""The gateway: carries out what sessions ask for, on one event loop that never computes for long.

One scene owns the outputs until it closes; any number of others watch. Touches are handled where
they arrive; frames are handed to the recogniser, newest first; ticks let leases lapse and follow
the plate.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

import msgspec

from hapticvlm.devices.faults import describe
from hapticvlm.devices.peltier import Plate
from hapticvlm.devices.speaker import Speaker
from hapticvlm.messages import Decision, Error, ErrorCode, Scope, ServiceMessage, Skipped, View
from hapticvlm.processes.recogniser import Recogniser
from hapticvlm.processes.vlm import Answer, Onlooker
from hapticvlm.recognition.frame_recogniser import Recognition
from hapticvlm.rendering.thermal import PlateReading
from hapticvlm.server import status
from hapticvlm.server.connection import Connection
from hapticvlm.server.outputs import Outputs
from hapticvlm.server.recognition_queue import Looks
from hapticvlm.server.recorder import Recorder
from hapticvlm.server.vlm_queue import Asker, Questions
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldAtRest,
    LookAt,
    Reply,
    Watch,
)
from hapticvlm.session.hands import Hold

TICK_S = 0.02
TELEMETRY_S = 0.1
WAVEFORM_S = 0.02  # what is heard in a browser lags by this and what the browser keeps in hand

logger = logging.getLogger(__name__)


class ObserverLog(logging.Handler):
    """Passes log lines on, always on the event loop: other threads log too.

    Make it where the event loop runs; `show` is called there with one line.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self._show = show
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line, soon."""
        text = self.format(record).encode("utf-8", "replace").decode()  # a path may be no text
        with suppress(RuntimeError):  # the loop has closed
            self._loop.call_soon_threadsafe(self._show, text)


class Gateway:
    """The outputs, the recogniser, and the connections that share them."""

    def __init__(
        self,
        speaker: Speaker,
        plate: Plate,
        recogniser: Recogniser,
        onlooker: Onlooker | None = None,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.owner: Connection | None = None
        self.connections: list[Connection] = []
        self.recorder: Recorder | None = None
        self._outputs = Outputs(speaker, plate)
        self._recogniser = recogniser
        self._looks = Looks(recogniser, self)
        self._questions = None if onlooker is None else Questions(onlooker, self)

    @property
    def hold(self) -> Hold:
        """What a stop still holds at rest, for every session."""
        return self._outputs.hold

    @property
    def reading(self) -> PlateReading:
        """What the plate last said."""
        return self._outputs.reading

    def join(self, connection: Connection) -> None:
        """Admit a connection; the first scene's is the owner's."""
        self.connections.append(connection)
        if connection.session.owner:
            self.owner = connection
            self._outputs.speaker.set_gain(1.0)

    def leave(self, connection: Connection) -> None:
        """Forget a connection; when it was the owner's, the outputs rest."""
        self.connections.remove(connection)
        self.counts += connection.counts
        connection.session.rest()
        if self._questions is not None:
            self._questions.forget(connection)
        if self.owner is connection:
            self.owner = None
            self._outputs.rest()

    def close(self) -> None:
        """Rest both outputs and move nothing from now on."""
        self._outputs.close()

    def carry_out(self, connection: Connection, actions: Iterable[Action]) -> list[ServiceMessage]:
        """Do what the session asked, in order; return what to send to its connection."""
        replies: list[ServiceMessage] = []
        for action in actions:
            match action:
                case Reply():
                    replies.append(action.message)
                    self._show(connection, action.message)
                case LookAt():
                    replies += self._looks.queue(connection, action)
                case AskAmbient() | AskMaterial():
                    self._ask(connection, action)
                case Watch():
                    connection.watches = action.kinds
                case HoldAtRest():
                    self._stop(action.scope)
                case _:
                    self._outputs.drive(action)
        return replies

    def refuse(self, code: ErrorCode) -> None:
        """Count a refused message."""
        self.counts[f"refused: {code}"] += 1

    def on_look(self, look: Recognition) -> None:
        """Take in the recogniser's answer (on the event loop)."""
        self._looks.take(look)

    def on_answer(self, answer: Answer) -> None:
        """Take in the onlooker's answer (on the event loop)."""
        if self._questions is not None:
            self._questions.take(answer, time.monotonic())

    def deliver_to(self, asker: Asker, actions: list[Action]) -> None:
        """Carry out what an answer brought, if who asked is still connected."""
        found = next((one for one in self.connections if one is asker), None)
        if found is not None:
            self.deliver(found, actions)

    def deliver(self, connection: Connection, actions: list[Action]) -> None:
        """Carry out actions that no message asked for just now; send what they tell."""
        for reply in self.carry_out(connection, actions):
            connection.post(reply)

    async def run_ticks(self) -> None:
        """Let leases lapse, follow the plate and watch the children, until cancelled."""
        while True:
            await asyncio.sleep(TICK_S)
            now = time.monotonic()
            self._follow_plate(now)
            if self.owner is not None:
                self.deliver(self.owner, self.owner.session.tick(now, self.reading))
            self._supervise(now)

    async def run_telemetry(self) -> None:
        """Tell every connection the state of the outputs, until cancelled."""
        while True:
            await asyncio.sleep(TELEMETRY_S)
            dropped = (n for name, n in self.counts.items() if name.startswith("frames "))
            telemetry = status.telemetry(
                self._outputs, dropped_frames=sum(dropped), leases=self._leases
            )
            for connection in self.connections:
                connection.post(telemetry)

    async def run_waveform(self) -> None:
        """Pass on what the speaker plays to the observers that watch it, until cancelled."""
        start = 0
        while True:
            await asyncio.sleep(WAVEFORM_S)
            watching = [other for other in self.connections if "waveform" in other.watches]
            if not watching:
                continue
            waveform = status.waveform(self._outputs.speaker, start)
            start = (waveform.start or 0) + len(waveform.samples or ())
            if waveform.samples:
                for connection in watching:
                    connection.post(waveform)

    def show_log(self, text: str) -> None:
        """Pass one log line to the observers that watch the log."""
        for connection in self.connections:
            if "log" in connection.watches:
                connection.post(View(id=0, kind="log", text=text))

    def status(self) -> dict[str, Any]:
        """Return every count, for the status page."""
        counts = sum((connection.counts for connection in self.connections), self.counts.copy())
        return {
            "connections": len(self.connections),
            "owner": self.owner.name if self.owner else None,
            "counts": dict(counts),
            **status.of_outputs(self._outputs),
            "leases": self._leases,
            "recogniser": status.of_recogniser(self._recogniser),
            "vlm": status.of_vlm(self._questions),
            "record": status.of_record(self.recorder),
        }

    @property
    def _leases(self) -> int:
        return self.owner.session.leases if self.owner else 0

    def _ask(self, connection: Connection, ask: Ask) -> None:
        if self._questions is not None:
            self._questions.queue(connection, ask, time.monotonic())

    def _show(self, connection: Connection, message: ServiceMessage) -> None:
        """Show observers what another connection is told; frames only to those who asked."""
        if isinstance(message, Skipped) and message.reason == "rate":
            self.counts["frames rate"] += 1
        if not isinstance(message, Decision):
            return
        shown = msgspec.structs.replace(
            message, id=0, name=connection.session.name(message.object_id)
        )
        for observer in self.connections:
            if observer is not connection and observer.session.observer:
                observer.post(shown)

    def _stop(self, scope: Scope) -> None:
        if self._outputs.is_closed:
            return
        self._outputs.stop(scope)
        for connection in self.connections:
            connection.session.held(scope)
        if scope == "all" and self.owner is not None:
            self.owner.session.rest()
        logger.warning("outputs stopped: %s", scope)

    def _follow_plate(self, now: float) -> None:
        new = self._outputs.follow(now)
        for fault in new:
            self._report(Error(id=0, code="device", text=f"plate fault: {describe(fault)}"))
        if new:
            self._stop("peltier")

    def _supervise(self, now: float) -> None:
        trouble = self._outputs.speaker.supervise(now)
        if trouble is not None:
            self._rest_owner()
            self._report(Error(id=0, code="device", text=trouble))
        trouble = self._recogniser.supervise(now)
        if trouble is not None:
            self._looks.fail(trouble)
            self._report(Error(id=0, code="model", text=trouble))
        trouble = None if self._questions is None else self._questions.supervise(now)
        if trouble is not None:
            self._report(Error(id=0, code="model", text=trouble))
        self._looks.feed()  # a recogniser that has just come back has nobody else to wake it

    def _rest_owner(self) -> None:
        if self.owner is not None:
            self.owner.session.rest()
        self._outputs.plate.rest(time.monotonic())

    def _report(self, error: Error) -> None:
        self.refuse(error.code)
        logger.error("%s", error.text)
        for connection in self.connections:
            connection.post(error)
