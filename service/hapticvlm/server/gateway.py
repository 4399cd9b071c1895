"""The gateway: carries out what sessions ask for, on one event loop that never computes for long.

One scene owns the outputs until it closes; any number of others watch. Touches are handled where
they arrive; frames are handed to the recogniser, newest first; ticks end lapsed leases and follow
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
from hapticvlm.messages import (
    Decision,
    Error,
    ErrorCode,
    MessageError,
    Ok,
    Scene,
    Scope,
    ServiceMessage,
    Set,
    Skipped,
    View,
)
from hapticvlm.processes.model_worker import Answered
from hapticvlm.processes.recogniser import Recognised, RecogniserWorker
from hapticvlm.processes.vlm import VlmReply, VlmWorker
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.server import status
from hapticvlm.server.connection import Connection, Event
from hapticvlm.server.log_writer import LOST, Folding, LogWriter
from hapticvlm.server.outputs import Driven, Outputs
from hapticvlm.server.recognition_queue import RecognitionQueue
from hapticvlm.server.recorder import Recorder
from hapticvlm.server.vibration_events import VibrationEvents
from hapticvlm.server.vlm_queue import VlmQueue
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldOutputs,
    RecogniseFrame,
    Reply,
    SendVibration,
    Watch,
)
from hapticvlm.session.hands import Hold

TICK_S = 0.02
TELEMETRY_S = 0.1
LOSSES_S = 10.0
IDLE_OWNER_S = 30.0  # without a lease, before another scene may take the outputs
PATH = "$.ownership"
WAVEFORM_S = 0.02  # sound in a browser lags by this and what the browser keeps in hand

logger = logging.getLogger(__name__)


class ObserverLog(logging.Handler):
    """Passes log lines on, always on the event loop: other threads log too.

    Make it where the event loop runs; `show` is called there with one line.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self._show = show
        self._folding = Folding()
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line, soon."""
        folded = self._folding.count(record)
        if folded is None:
            return
        line = self.format(record) + folded
        text = line.encode("utf-8", "replace").decode()  # a path may be no text
        with suppress(RuntimeError):  # the loop has closed
            self._loop.call_soon_threadsafe(self._show, text)


class Gateway:
    """The outputs, the recogniser, and the connections that share them."""

    def __init__(
        self,
        speaker: Speaker,
        plate: Plate,
        recogniser: RecogniserWorker,
        vlm: VlmWorker | None = None,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.owner: Connection | None = None
        self.connections: list[Connection] = []
        self.recorder: Recorder | None = None
        self.log: LogWriter | None = None
        self._outputs = Outputs(speaker, plate)
        self._leased_at = time.monotonic()
        self._lost_lines, self._losses_at = 0, float("-inf")
        self._recogniser = recogniser
        self._vibration = VibrationEvents(speaker)
        self._recognition = RecognitionQueue(recogniser, self.counts, self.deliver)
        self._vlm = None if vlm is None else VlmQueue(vlm, self.counts, self.deliver)

    @property
    def hold(self) -> Hold:
        """What a stop still holds at rest, for every session."""
        return self._outputs.hold

    @property
    def thermal_gain(self) -> float:
        """The thermal gain that was set last, by whichever owner."""
        return self._outputs.thermal_gain

    @property
    def reading(self) -> PlateReading:
        """The plate's last reading."""
        return self._outputs.reading

    def join(self, connection: Connection) -> None:
        """Admit a connection; the first scene's is the owner's. A gain that was set stays."""
        self._leased_at = time.monotonic()
        self.connections.append(connection)
        self._recognition.join(connection)
        if connection.session.owner:
            self.owner = connection

    def leave(self, connection: Connection) -> None:
        """Forget a connection; when it was the owner's, the outputs rest."""
        self.connections.remove(connection)
        self.counts.update(connection.counts)
        connection.session.rest()
        self._recognition.leave(connection)
        if self._vlm is not None:
            self._vlm.leave(connection)
        if self.owner is connection:
            self.owner = None
            self._outputs.rest()
            self._vibration.end()

    def change_owner(self, requester: Connection, wanted: Set, now: float) -> None:
        """Assign the outputs to the scene that asks, or end their owner. Raises MessageError."""
        if wanted.ownership == "end":
            if self.owner is None:
                raise MessageError("message", "nobody owns the outputs", path=PATH, id=wanted.id)
            logger.warning("%s ended by %s", self.owner.name, requester.name)
            self.counts["owners ended"] += 1
            self._outputs.rest()
            self.owner.end("ended by an observer")
            return
        if requester.session.observer:
            text = "an observer owns no outputs: connect as scene"
            raise MessageError("not_owner", text, path=PATH, id=wanted.id)
        if self.owner is not None and self.owner is not requester:
            self._depose(self.owner, wanted, now)
            self._vibration.rest()
            self._vibration.end()
        self.owner = requester
        self._leased_at = now
        requester.session.set_owner(owner=True, thermal_gain=self.thermal_gain)

    def state_materials(self, observer: Connection, scene: Scene, now: float) -> Ok:
        """Apply to the owner's scene what a person states of it. Raises MessageError."""
        if not observer.is_local:
            text = (
                "observers describe no scene; only the dashboard on the service's own machine may"
            )
            raise MessageError("protocol", text, path="$.type", id=scene.id)
        if self.owner is None:
            text = "no scene owns the outputs: connect one, and state its objects' materials then"
            raise MessageError("not_owner", text, path="$.type", id=scene.id)
        owner = self.owner
        actions = owner.session.receive(owner.session.with_materials(scene), now)
        owner.stated.update(
            (given.object_id, given.material) for given in scene.objects if given.material
        )
        answered = Ok(id=scene.id)
        self.deliver(owner, [action for action in actions if action != Reply(answered)])
        names = ", ".join(f"{given.object_id} {given.material}" for given in scene.objects)
        logger.info("%s said: %s", observer.name, names)
        return answered

    def close(self) -> None:
        """Rest both outputs and move nothing from now on."""
        self._outputs.close()
        self._vibration.rest()

    def carry_out(self, connection: Connection, actions: Iterable[Action]) -> list[ServiceMessage]:
        """Do what the session asked, in order; return what to send to its connection."""
        replies: list[ServiceMessage] = []
        for action in actions:
            match action:
                case Reply():
                    replies.append(action.message)
                    self._show(connection, action.message)
                case RecogniseFrame():
                    replies += self._recognition.put(connection, action)
                case AskAmbient() | AskMaterial():
                    self._ask(connection, action)
                case Watch():
                    connection.watches = action.kinds
                case SendVibration():
                    self._vibration.subscribe(action.forms, connection.post)
                case HoldOutputs():
                    self._stop(action.scope)
                case _:
                    self._drive(action)
        return replies

    def refuse(self, code: ErrorCode) -> None:
        """Count a refused message."""
        self.counts[f"refused: {code}"] += 1

    def on_recognised(self, answered: Answered[Recognised]) -> None:
        """Receive the recogniser's answer (on the event loop)."""
        self._recognition.accept(answered)

    def on_reply(self, answered: Answered[VlmReply]) -> None:
        """Receive the VLM worker's reply (on the event loop)."""
        if self._vlm is not None:
            self._vlm.accept(answered, time.monotonic())

    def deliver(self, connection: Connection, actions: list[Action]) -> None:
        """Carry out actions that no message asked for just now; send their messages."""
        for reply in self.carry_out(connection, actions):
            connection.post(reply)

    async def run_ticks(self) -> None:
        """End lapsed leases, follow the plate and watch the children, until cancelled."""
        while True:
            await asyncio.sleep(TICK_S)
            now = time.monotonic()
            self._follow_plate(now)
            if self.owner is not None:
                self._leased_at = now if self._leases else self._leased_at
                self.deliver(self.owner, self.owner.session.tick(now, self.reading))
                if self._vibration.is_on:
                    self._vibration.tick(now)
            self._supervise(now)

    async def run_telemetry(self) -> None:
        """Report the state of the outputs to every connection, until cancelled."""
        while True:
            await asyncio.sleep(TELEMETRY_S)
            dropped = (n for name, n in self.counts.items() if name.startswith("frames "))
            telemetry = status.telemetry(
                self._outputs, dropped_frames=sum(dropped), leases=self._leases
            )
            event = Event(telemetry)
            for connection in self.connections:
                connection.post(event)

    async def run_waveform(self) -> None:
        """Send what the speaker plays to the observers that watch it, until cancelled."""
        start = 0
        while True:
            await asyncio.sleep(WAVEFORM_S)
            watching = [other for other in self.connections if "waveform" in other.watches]
            if not watching:
                continue
            waveform = status.waveform(self._outputs.speaker, start)
            start = (waveform.start or 0) + len(waveform.samples or ())
            if waveform.samples:
                event = Event(waveform)
                for connection in watching:
                    connection.post(event)

    def show_log(self, text: str) -> None:
        """Send one log line to the observers that watch the log."""
        line = Event(View(id=0, kind="log", text=text))
        for connection in self.connections:
            if "log" in connection.watches:
                connection.post(line)

    def status(self) -> dict[str, Any]:
        """Return every count, for the status page."""
        counts = sum((connection.counts for connection in self.connections), self.counts.copy())
        return {
            "connections": len(self.connections),
            "owner": self.owner.name if self.owner else None,
            "owner_idle_s": round(time.monotonic() - self._leased_at, 1) if self.owner else None,
            "counts": {**counts, LOST: 0 if self.log is None else self.log.lost},
            **status.of_outputs(self._outputs),
            "leases": self._leases,
            "recogniser": status.of_recogniser(self._recogniser),
            "vlm": status.of_vlm(self._vlm),
            "record": status.of_record(self.recorder),
        }

    @property
    def _leases(self) -> int:
        return self.owner.session.leases if self.owner else 0

    def _depose(self, owner: Connection, wanted: Set, now: float) -> None:
        """Take the outputs from an owner that touches nothing. Raises MessageError."""
        idle_s = now - self._leased_at
        if idle_s < IDLE_OWNER_S:
            text = (
                f"{owner.name} owns the outputs and touched something {idle_s:.0f} s ago: "
                f"wait until {IDLE_OWNER_S:.0f} s have passed, or end it from the dashboard"
            )
            raise MessageError("not_owner", text, path=PATH, id=wanted.id)
        owner.session.set_owner(owner=False)
        owner.session.rest()
        self._outputs.rest()
        self.counts["owners replaced"] += 1
        text = f"another scene took the outputs: nothing was touched for {idle_s:.0f} s"
        owner.post(Error(id=0, code="not_owner", text=text))

    def _drive(self, action: Driven) -> None:
        self._outputs.drive(action)
        if self._vibration.is_on:
            self._vibration.drive(action)

    def _ask(self, connection: Connection, ask: Ask) -> None:
        if self._vlm is not None:
            self._vlm.put(connection, ask, time.monotonic())

    def _show(self, connection: Connection, message: ServiceMessage) -> None:
        """Send observers what another connection is sent; frames only to those who asked."""
        if isinstance(message, Skipped) and message.reason == "rate":
            self.counts["frames rate"] += 1
        if not isinstance(message, Decision):
            return
        name = connection.session.name(message.object_id)
        event = Event(msgspec.structs.replace(message, id=0, name=name))
        for observer in self.connections:
            if observer is not connection and observer.session.observer:
                observer.post(event)

    def _stop(self, scope: Scope) -> None:
        if self._outputs.is_closed:
            return
        self._outputs.stop(scope)
        if scope != "peltier":
            self._vibration.stop()
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
        trouble = self._recogniser.worker.supervise(now)
        if trouble is not None:
            self._recognition.fail(trouble)
            self._report(Error(id=0, code="model", text=trouble))
        trouble = None if self._vlm is None else self._vlm.supervise(now)
        if trouble is not None:
            self._report(Error(id=0, code="model", text=trouble))
        self._report_losses(now)
        self._recognition.feed()  # a recogniser that has just come back has nobody else to wake it

    def _report_losses(self, now: float) -> None:
        """Report that the record misses lines, when it begins and from time to time."""
        lost = 0 if self.recorder is None else self.recorder.lost
        if lost <= self._lost_lines or now - self._losses_at < LOSSES_S:
            return
        self._lost_lines, self._losses_at = lost, now
        text = f"the record misses {lost} lines: free the disk, or record without pictures"
        self._report(Error(id=0, code="overload", text=text))

    def _rest_owner(self) -> None:
        if self.owner is not None:
            self.owner.session.rest()
        self._vibration.rest()
        self._outputs.plate.rest(time.monotonic())

    def _report(self, error: Error) -> None:
        self.refuse(error.code)
        logger.error("%s", error.text)
        event = Event(error)
        for connection in self.connections:
            connection.post(event)
