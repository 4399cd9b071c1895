"""SceneSession: the protocol's state machine for one connection. Does no I/O and reads no clock.

Feed it messages, recognitions and ticks with the time; carry out the actions it returns, in order.
What is wrong, or not its sender's to say, raises MessageError before anything has changed.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.materials import MATERIALS, Material
from hapticvlm.messages import (
    ClientMessage,
    Frame,
    Hello,
    MessageError,
    Ok,
    Scene,
    Scope,
    Set,
    Skipped,
    SkipReason,
    Stop,
    Touch,
)
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.rendering.heat.limits import AT_REST, PlateReading
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldOutputs,
    KeepThermalGain,
    RecogniseFrame,
    Reply,
    SendVibration,
    SetGain,
    Watch,
)
from hapticvlm.session.declared_evidence import NONE_SAVED
from hapticvlm.session.frames import SURROUNDINGS, Frames, recognise_scene
from hapticvlm.session.hands import Hold
from hapticvlm.session.permissions import check_describes, check_set, with_materials
from hapticvlm.session.plate_target import PlateTarget
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.touch import TouchTracker, check_touch


class SceneSession:
    """One connection's scene: what it is believed to be, and the hands that touch it."""

    def __init__(
        self,
        *,
        owner: bool,
        observer: bool = False,
        hold: Hold | None = None,
        reading: PlateReading = AT_REST,
        table: Mapping[str, Material] = MATERIALS,
        saved: Mapping[str, str] = NONE_SAVED,
        can_ask: bool = False,
        contact_resistance: float | None = None,
        plate_resistance: float = PLATE_RESISTANCE,
        thermal_gain: float = 1.0,
    ) -> None:
        self.owner = owner
        self.observer = observer
        self._model = SceneModel(
            table, saved, can_ask=can_ask, contact_resistance=contact_resistance
        )
        self._frames = Frames()
        plate = PlateTarget(reading, plate_resistance, thermal_gain)
        self._touches = TouchTracker(self._model, self._frames, hold or Hold(), plate)

    @property
    def materials(self) -> tuple[str, ...]:
        """What this scene's objects may be made of."""
        return self._model.materials

    def name(self, object_id: str | None) -> str | None:
        """Return what the scene calls this object, if it gave it a name."""
        facts = None if object_id is None else self._model.objects.facts(object_id)
        return None if facts is None else facts.name

    def with_materials(self, scene: Scene) -> Scene:
        """Return an observer's scene with all that is known here. Raises MessageError."""
        return with_materials(scene, self._model.objects.given)

    @property
    def leases(self) -> int:
        """How many hands hold a lease."""
        return self._touches.hands.leases

    @property
    def late_contacts(self) -> int:
        """How many contacts made no impact because they came too late."""
        return self._touches.late_contacts

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Receive one message; raises MessageError if it is refused."""
        if not self._model.surroundings.is_settled:
            self._model.surroundings.update(now)
        match message:
            case Touch():
                check_touch(message, owner=self.owner)
                return self._touches.receive(message, now)
            case Frame():
                return self._frame(message, now)
            case Scene():
                return self._scene(message)
            case Set():
                return self._set(message)
            case Stop():
                return [HoldOutputs(message.scope), Reply(Ok(id=message.id))]
            case Hello():
                text = "hello was already said; open a new connection to start again"
                raise MessageError("protocol", text, path="$.type", id=message.id)

    def scene_view_received(
        self, action: RecogniseFrame, scene_view: SceneView | None, now: float
    ) -> list[Action]:
        """Receive the scene view; None means it has not changed."""
        if scene_view is None:
            return []
        view = self._model.surroundings.update_view(scene_view, now)
        return [] if view is None else [AskAmbient(action.frame, view)]

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Receive what a VLM answered; None means it has no answer."""
        surroundings, objects = self._model.surroundings, self._model.objects
        surroundings.update(now)
        match ask, answer:
            case AskAmbient(), Reading():
                surroundings.add_reading(ask.view, answer, now)
            case AskAmbient(), _:
                surroundings.fail(ask.view)
            case AskMaterial(), Evidence() if ask.generation == objects.generation(ask.key):
                objects.add_reply(ask.key, answer)
        return self._touches.refresh()

    def recognised(
        self,
        action: RecogniseFrame,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive what a recognition gave; None means its picture has not changed."""
        frame, key = action.frame, action.key
        if action.teaches is not None:
            return []
        if action.generation != self._model.objects.generation(key):
            return self.skipped(frame, "superseded")
        if evidence is None:
            return self.skipped(frame, "unchanged")
        self._model.objects.add_recognition(key, evidence)
        has_changed = self._touches.changed_decision(key) is not None
        actions: list[Action] = []
        if frame.id or has_changed:
            answer = msgspec.structs.replace(
                self._touches.decision(key),
                id=frame.id,
                stages_ms=stages_ms,
                frame_age_ms=self._frames.age_s(frame, now) * 1000.0,
            )
            actions.append(Reply(answer))
        return [*actions, *self._touches.refresh_texture(key), *self._model.question(action, now)]

    def skipped(self, frame: Frame, reason: SkipReason) -> list[Action]:
        """Answer that `frame` was not recognised."""
        return [Reply(Skipped(id=frame.id, reason=reason))] if frame.id else []

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Whether the frame has outlived its own `max_age_ms`."""
        return self._frames.is_stale(frame, now)

    def wants_anew(self, action: RecogniseFrame) -> bool:
        """Whether to recognise even an unchanged picture: nothing is kept of what it shows."""
        return action.key != SURROUNDINGS and not self._model.objects.is_recognised(action.key)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """End leases that lapsed and move the plate; call at 50 Hz or so while owner."""
        self._model.surroundings.update(now)
        return self._touches.tick(now, reading)

    def set_owner(self, *, owner: bool, thermal_gain: float | None = None) -> None:
        """Set whether this scene may drive the outputs from now on, and the gain it finds set."""
        self.owner = owner
        if thermal_gain is not None:
            self._touches.plate.gain = thermal_gain

    def rest(self) -> None:
        """Drop every lease: the outputs were put to rest from outside."""
        self._touches.hands.release()

    def held(self, scope: Scope) -> None:
        """Note that outputs were stopped; the hold itself is shared by all sessions."""

    def _frame(self, frame: Frame, now: float) -> list[Action]:
        check_describes(frame, observer=self.observer)
        if not self._frames.admits(frame, now):
            return self.skipped(frame, "rate")
        touched: list[Action] = []
        if frame.purpose == "live":
            touched = self._touches.recognise_again()
            if self._model.surroundings.wants_scene_view(now):
                touched.append(recognise_scene(frame))
        return [*touched, *self._answer_frame(frame, now)]

    def _answer_frame(self, frame: Frame, now: float) -> list[Action]:
        """Answer at once what needs no recognition, else recognise the frame."""
        key, objects = frame.object_id, self._model.objects
        if key is None or objects.needs_recognition(key):
            generation = objects.generation(key)
            return [RecogniseFrame(frame, key, generation, scene=objects.scene_number)]
        cached = self._model.has_verdict(key)
        age_ms = self._frames.age_s(frame, now) * 1000.0
        decision = self._touches.decision(key)
        answer = msgspec.structs.replace(decision, id=frame.id, cached=cached, frame_age_ms=age_ms)
        return [Reply(answer), *self._model.teaching(frame, key)]

    def _scene(self, scene: Scene) -> list[Action]:
        check_describes(scene, observer=self.observer)
        updated = () if scene.replace else scene.objects
        announced = self._model.announced(given.object_id for given in updated)
        self._model.declare(scene)
        changed = self._touches.announce_changes(announced)
        return [Reply(Ok(id=scene.id)), *self._touches.refresh(), *changed]

    def _set(self, wanted: Set) -> list[Action]:
        check_set(wanted, owner=self.owner, observer=self.observer)
        actions: list[Action] = []
        if wanted.feel is not None:
            actions.append(SendVibration((wanted.feel.left, wanted.feel.right)))
        if wanted.watch is not None:
            actions.append(Watch(frozenset(wanted.watch)))
        if wanted.ambient_c is not None:
            self._model.surroundings.scene_c = wanted.ambient_c
        if wanted.thermal_gain is not None:
            self._touches.plate.gain = wanted.thermal_gain
            actions.append(KeepThermalGain(wanted.thermal_gain))
        if wanted.vibration_gain is not None:
            actions.append(SetGain(wanted.vibration_gain))
        return [*actions, Reply(Ok(id=wanted.id)), *self._touches.refresh()]
