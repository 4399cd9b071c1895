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
from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np

from hapticvlm.devices.faults import describe
from hapticvlm.devices.peltier import Plate
from hapticvlm.devices.speaker import Speaker
from hapticvlm.messages import (
    Decision,
    Error,
    ErrorCode,
    ServiceMessage,
    Skipped,
    Telemetry,
    View,
)
from hapticvlm.onlooker import Answer, Onlooker
from hapticvlm.recogniser import Recogniser
from hapticvlm.recognition.eye import Look
from hapticvlm.rendering.thermal import PlateReading
from hapticvlm.server.connection import Connection
from hapticvlm.server.looks import Looks
from hapticvlm.server.questions import Asker, Questions
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    Feel,
    Heat,
    HoldAtRest,
    LetGo,
    LookAt,
    Reply,
    RestPlate,
    SetGain,
    Watch,
)
from hapticvlm.session.hands import NAMES, Hold

WAITS = 512
TICK_S = 0.02
TELEMETRY_S = 0.1
VIEW_SAMPLES, VIEW_STEP = 4800, 16

logger = logging.getLogger(__name__)


class Gateway:
    """The outputs, the recogniser, and the connections that share them."""

    def __init__(
        self,
        speaker: Speaker,
        plate: Plate,
        recogniser: Recogniser,
        onlooker: Onlooker | None = None,
    ) -> None:
        self.hold = Hold()
        self.counts: Counter[str] = Counter()
        self.owner: Connection | None = None
        self._speaker = speaker
        self._plate = plate
        self._recogniser = recogniser
        self.connections: list[Connection] = []
        self._looks = Looks(recogniser, self)
        self._onlooker = onlooker
        self._questions = None if onlooker is None else Questions(onlooker, self)
        self._reading: PlateReading = plate.advance(time.monotonic())
        self._is_closing = False

    @property
    def reading(self) -> PlateReading:
        """What the plate last said."""
        return self._reading

    def join(self, connection: Connection) -> None:
        """Admit a connection; the first scene's is the owner's."""
        self.connections.append(connection)
        if connection.session.owner:
            self.owner = connection
            self._speaker.set_gain(1.0)

    def leave(self, connection: Connection) -> None:
        """Forget a connection; when it was the owner's, the outputs rest."""
        self.connections.remove(connection)
        connection.session.rest()
        if self._questions is not None:
            self._questions.forget(connection)
        if self.owner is connection:
            self.owner = None
            self.rest()

    def close(self) -> None:
        """Rest both outputs and move nothing from now on."""
        self._is_closing = True
        self.rest()

    def rest(self) -> None:
        """Rest both outputs at once."""
        self._speaker.rest()
        self._plate.rest(time.monotonic())

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
                case _:
                    self._drive(action)
        return replies

    def refuse(self, code: ErrorCode) -> None:
        """Count a refused message."""
        self.counts[f"refused: {code}"] += 1

    def on_look(self, look: Look) -> None:
        """Take in the recogniser's answer (on the event loop)."""
        self._looks.take(look)

    def on_answer(self, answer: Answer) -> None:
        """Take in the onlooker's answer (on the event loop)."""
        if self._questions is not None:
            self._questions.take(answer, time.monotonic())

    def deliver_to(self, asker: Asker, actions: list[Action]) -> None:
        """Carry out what an answer brought, if who asked is still connected."""
        for connection in self.connections:
            if connection is asker:
                self.deliver(connection, actions)

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
                self.deliver(self.owner, self.owner.session.tick(now, self._reading))
            self._supervise(now)

    async def run_telemetry(self) -> None:
        """Tell every connection the state of the outputs, until cancelled."""
        while True:
            await asyncio.sleep(TELEMETRY_S)
            telemetry = self._telemetry()
            for connection in self.connections:
                connection.post(telemetry)
            watching = [other for other in self.connections if "waveform" in other.watches]
            if watching:
                waveform = self._waveform()
                for connection in watching:
                    connection.post(waveform)

    def show_log(self, text: str) -> None:
        """Pass one log line to the observers that watch the log."""
        for connection in self.connections:
            if "log" in connection.watches:
                connection.post(View(id=0, kind="log", text=text))

    def status(self) -> dict[str, Any]:
        """Return every count, for the status page."""
        counts = self.counts.copy()
        for connection in self.connections:
            counts += connection.counts
        engine = self._speaker.status()
        return {
            "connections": len(self.connections),
            "owner": self.owner.name if self.owner else None,
            "counts": dict(counts),
            "speaker": {
                "name": self._speaker.name,
                "simulated": self._speaker.simulated,
                "realtime": engine.realtime,
                "level": engine.level,
                "underruns": self._speaker.underruns,
                "lost_commands": engine.lost,
                "scrubbed": engine.scrubbed,
                "restarts": self._speaker.restarts,
                "command_wait_ms": self._command_wait_ms(),
                "pid": self._speaker.pid,
                "plays": self._speaker.plays,
                "faults": {name: describe(name) for name in self._speaker.faults},
            },
            "plate": {
                "name": self._plate.name,
                "simulated": self._plate.simulated,
                "setpoint_c": self._reading.setpoint_c,
                "plate_c": self._reading.plate_c,
                "dose_cem43": self._reading.dose_cem43,
                "heated_s": self._reading.heated_s,
                "faults": {name: describe(name) for name in self._reading.faults},
                "counts": self._plate.counts,
            },
            "leases": self.owner.session.leases if self.owner else 0,
            "held": {hand: self.hold.outputs(hand) for hand in NAMES},
            "recogniser": {
                "restarts": self._recogniser.restarts,
                "pid": self._recogniser.pid,
                "busy_s": round(self._recogniser.busy_s, 3),
                "encoder": self._recogniser.loaded.encoder,
            },
            "vlm": self._vlm_status(),
        }

    def _command_wait_ms(self) -> dict[str, float] | None:
        """How long the newest commands waited for the block that plays them."""
        newest = self._speaker.status().newest
        waits = self._speaker.delays(max(1, newest - WAITS + 1), newest) * 1000.0
        if not waits.size:
            return None
        return {
            "n": waits.size,
            "median": float(np.median(waits)),
            "p99": float(np.percentile(waits, 99)),
        }

    def _ask(self, connection: Connection, ask: Ask) -> None:
        if self._questions is not None:
            self._questions.queue(connection, ask, time.monotonic())

    def _vlm_status(self) -> dict[str, Any] | None:
        if self._onlooker is None or self._questions is None:
            return None
        return {
            "name": self._onlooker.name,
            "remote": self._onlooker.settings.url is not None,
            "absent": self._onlooker.absent,
            "busy": self._onlooker.is_busy,
            "restarts": self._onlooker.restarts,
            "pid": self._onlooker.pid,
            "answered": self._questions.answered,
            "failed": self._questions.failed,
            "dropped": self._questions.dropped,
            "last_error": self._questions.last_error,
        }

    def _drive(self, action: Feel | LetGo | SetGain | Heat | RestPlate | HoldAtRest) -> None:
        if self._is_closing:
            return
        match action:
            case Feel():
                self._speaker.obey(action.command)
            case LetGo():
                self._speaker.let_go(action.hand)
            case SetGain():
                self._speaker.set_gain(action.gain)
            case Heat():
                self._plate.command(action.setpoint_c, action.ttl_s, time.monotonic())
            case RestPlate():
                self._plate.rest(time.monotonic())
            case HoldAtRest():
                self._stop(action)

    def _show(self, connection: Connection, message: ServiceMessage) -> None:
        """Show observers what another connection is told; frames only to those who asked."""
        if isinstance(message, Skipped) and message.reason == "rate":
            self.counts["frames rate"] += 1
        if not isinstance(message, Decision):
            return
        for observer in self.connections:
            if observer is not connection and observer.session.observer:
                observer.post(msgspec.structs.replace(message, id=0))

    def _stop(self, action: HoldAtRest) -> None:
        self.hold.stop(action.scope)
        for connection in self.connections:
            connection.session.held(action.scope)
        if action.scope != "peltier":
            self._speaker.rest()
        if action.scope != "speaker":
            self._plate.rest(time.monotonic())
        if action.scope == "all" and self.owner is not None:
            self.owner.session.rest()
        logger.warning("outputs stopped: %s", action.scope)

    def _follow_plate(self, now: float) -> None:
        before = self._reading.faults
        self._reading = self._plate.advance(now)
        new = [fault for fault in self._reading.faults if fault not in before]
        for fault in new:
            self._report(Error(id=0, code="device", text=f"plate fault: {describe(fault)}"))
        if new:
            self._stop(HoldAtRest("peltier"))

    def _supervise(self, now: float) -> None:
        trouble = self._speaker.supervise(now)
        if trouble is not None:
            self._rest_owner()
            self._report(Error(id=0, code="device", text=trouble))
        trouble = self._recogniser.supervise(now)
        if trouble is not None:
            self._looks.fail(trouble)
            self._report(Error(id=0, code="model", text=trouble))
        self._supervise_onlooker(now)
        self._looks.feed()  # a recogniser that has just come back has nobody else to wake it

    def _supervise_onlooker(self, now: float) -> None:
        if self._onlooker is None or self._questions is None:
            return
        trouble = self._onlooker.supervise(now)
        if trouble is not None:
            self._report(Error(id=0, code="model", text=trouble))
            self._questions.fail(trouble, now)
        self._questions.feed(now)

    def _rest_owner(self) -> None:
        if self.owner is not None:
            self.owner.session.rest()
        self._plate.rest(time.monotonic())

    def _report(self, error: Error) -> None:
        self.refuse(error.code)
        logger.error("%s", error.text)
        for connection in self.connections:
            connection.post(error)

    def _telemetry(self) -> Telemetry:
        plate = self._reading
        return Telemetry(
            id=0,
            plate_c=plate.plate_c,
            setpoint_c=plate.setpoint_c,
            sink_c=plate.sink_c,
            duty=plate.duty,
            speaker_level=self._speaker.loudest(),
            underruns=self._speaker.underruns,
            dropped_frames=sum(
                count for name, count in self.counts.items() if name.startswith("frames ")
            ),
            leases=self.owner.session.leases if self.owner else 0,
            faults=[*plate.faults, *self._speaker.faults],
        )

    def _waveform(self) -> View:
        samples = self._speaker.waveform(VIEW_SAMPLES)[::VIEW_STEP]
        return View(id=0, kind="waveform", rate_hz=48_000 / VIEW_STEP, samples=samples.tolist())


class ObserverLog(logging.Handler):
    """Passes log lines to the observers that watch the log; used on the event loop's thread."""

    def __init__(self, gateway: Gateway) -> None:
        super().__init__()
        self._gateway = gateway

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line."""
        self._gateway.show_log(self.format(record))
