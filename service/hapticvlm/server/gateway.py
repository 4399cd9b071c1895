"""Carries out the actions of sessions, on one event loop that never computes for long.

One scene owns the outputs until it closes; any number of others watch. Touches are handled where
they arrive; frames are handed to the recogniser, newest first; ticks end lapsed leases and follow
the plate.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Iterable, Sequence

import msgspec

from hapticvlm.devices.plate.plate import Plate
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.devices.worn.output import WornOutput
from hapticvlm.messages import (
    Decision,
    ErrorCode,
    MessageError,
    Ok,
    Scene,
    Scope,
    ServiceMessage,
    Skipped,
    View,
)
from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.server.connection import Connection, Event
from hapticvlm.server.counters import Count, refused
from hapticvlm.server.edge.scheduling import IdleScheduler
from hapticvlm.server.log_writer import LogWriter
from hapticvlm.server.outputs import OutputAction, Outputs
from hapticvlm.server.ownership import OutputOwnership
from hapticvlm.server.recognition_queue import RecognitionQueue
from hapticvlm.server.vibration_events import VibrationEvents
from hapticvlm.server.vlm_queue import VlmQueue
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldOutputs,
    Reply,
    SendVibration,
    Watch,
)
from hapticvlm.session.hands import Hand
from hapticvlm.session.overrides import materials_of
from hapticvlm.session.targets import RecognitionRequest
from hapticvlm.vision.worker import RecogniserWorker
from hapticvlm.vlm.worker import VlmReply, VlmWorker

logger = logging.getLogger(__name__)


class Gateway:
    """The outputs, the recogniser, and the connections that share them."""

    def __init__(
        self,
        speaker: Speaker,
        plate: Plate,
        recogniser: RecogniserWorker,
        vlm: VlmWorker | None = None,
        *,
        recorder: Recorder | None = None,
        log: LogWriter | None = None,
        worn: Sequence[WornOutput] = (),
    ) -> None:
        self.counts: Counter[Count] = Counter()
        self.connections: list[Connection] = []
        self.recorder = recorder
        self.log = log
        self.scheduler = IdleScheduler()
        self.outputs = Outputs(speaker, plate, worn)
        self.recogniser = recogniser
        self.vibration = VibrationEvents(speaker)
        self.ownership = OutputOwnership(
            self.outputs, self.vibration, self.connections, self.counts
        )
        self.recognition = RecognitionQueue(recogniser, self.counts, self.deliver)
        self.vlm = None if vlm is None else VlmQueue(vlm, self.counts, self.deliver)

    @property
    def owner(self) -> Connection | None:
        """The scene that owns the outputs."""
        return self.ownership.owner

    def join(self, connection: Connection) -> None:
        """Admit a connection; the first scene's is the owner's. A gain that was set stays."""
        self.connections.append(connection)
        self.recognition.join(connection)
        self.ownership.join(connection)

    def leave(self, connection: Connection) -> None:
        """Forget a connection; when it was the owner's, the outputs rest."""
        self.connections.remove(connection)
        self.counts.update(connection.counts)
        connection.session.rest()
        self.recognition.leave(connection)
        if self.vlm is not None:
            self.vlm.leave(connection)
        self.ownership.leave(connection)

    def override_materials(self, observer: Connection, scene: Scene, now: float) -> Ok:
        """Apply to the owner's scene the materials that an observer states of its objects.

        Raises MessageError.
        """
        if not observer.is_local:
            text = (
                "observers describe no scene; only the dashboard on the service's own machine may"
            )
            raise MessageError("protocol", text, path="$.type", id=scene.id)
        if self.owner is None:
            text = "no scene owns the outputs: connect one, and state its objects' materials then"
            raise MessageError("not_owner", text, path="$.type", id=scene.id)
        self.deliver(self.owner, self.owner.session.override(scene, now))
        names = ", ".join(
            f"{each.object_id}{path} {material}"
            for each in scene.objects
            for path, material in materials_of(each).items()
        )
        logger.info("%s stated: %s", observer.name, names)
        return Ok(id=scene.id)

    def close(self) -> None:
        """Rest both outputs and drive neither again."""
        self.outputs.close()
        self.vibration.rest()

    def carry_out(self, connection: Connection, actions: Iterable[Action]) -> list[ServiceMessage]:
        """Carry out the actions of a session in order; return the messages for its connection."""
        replies: list[ServiceMessage] = []
        for action in actions:
            match action:
                case Reply():
                    replies.append(action.message)
                    self._show(connection, action.message)
                case RecognitionRequest():
                    replies += self.recognition.put(connection, action)
                case AskAmbient() | AskMaterial():
                    self._ask(connection, action)
                case Watch():
                    connection.watches = action.kinds
                case SendVibration():
                    self.vibration.subscribe(action.forms, connection.post)
                case HoldOutputs():
                    self.stop(action.scope)
                case _:
                    self._drive(action)
        return replies

    def refuse(self, code: ErrorCode) -> None:
        """Count a refused message."""
        self.counts[refused(code)] += 1

    def on_reply(self, reply: WorkerReply[VlmReply]) -> None:
        """Receive the VLM worker's reply (on the event loop)."""
        if self.vlm is not None:
            self.vlm.accept(reply, time.monotonic())

    def deliver(self, connection: Connection, actions: list[Action]) -> None:
        """Carry out actions that do not answer a message; post their messages."""
        for reply in self.carry_out(connection, actions):
            connection.post(reply)

    def show_log(self, text: str) -> None:
        """Send one log line to the observers that watch the log."""
        line = Event(View(id=0, kind="log", text=text))
        for connection in self.connections:
            if "log" in connection.watches:
                connection.post(line)

    @property
    def leases(self) -> int:
        """Number of hands of the owner that hold a lease."""
        return self.owner.session.leases if self.owner else 0

    @property
    def touching(self) -> Hand | None:
        """The hand of the owner that touches, of its latest contact."""
        return self.owner.session.touching if self.owner else None

    def _drive(self, action: OutputAction) -> None:
        self.outputs.drive(action)
        if self.vibration.is_on:
            self.vibration.drive(action)

    def _ask(self, connection: Connection, ask: Ask) -> None:
        if self.vlm is not None:
            self.vlm.put(connection, ask, time.monotonic())

    def _show(self, connection: Connection, message: ServiceMessage) -> None:
        """Send a connection's decisions to all observers."""
        if isinstance(message, Skipped) and message.reason == "rate":
            self.counts[Count.FRAMES_RATE] += 1
        if not isinstance(message, Decision):
            return
        name = connection.session.name(message.object_id, message.surface)
        event = Event(msgspec.structs.replace(message, id=0, name=name))
        for observer in self.connections:
            if observer is not connection and observer.session.observer:
                observer.post(event)

    def stop(self, scope: Scope) -> None:
        """Rest and hold the outputs of this scope, for every session."""
        if self.outputs.is_closed:
            return
        self.outputs.stop(scope)
        if scope != "peltier":
            self.vibration.stop()
        for connection in self.connections:
            if isinstance(connection.session, RecordedSession):
                connection.session.write_stop(scope)
        if scope == "all" and self.owner is not None:
            self.owner.session.rest()
        logger.warning("outputs stopped: %s", scope)
