"""SceneSession: the protocol's state machine for one connection. Does no I/O and reads no clock.

Feed it messages, recognitions and ticks with the time; carry out the actions it returns, in order.
A message that is wrong, or that its sender may not send, raises MessageError before anything has
changed.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.messages import (
    ClientMessage,
    Frame,
    Hello,
    LeftOut,
    MessageError,
    Ok,
    Scene,
    Set,
    Skipped,
    SkipReason,
    Stop,
    Textures,
    Touch,
)
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldOutputs,
    KeepThermalGain,
    Reply,
    SendVibration,
    SetGain,
    Watch,
)
from hapticvlm.session.frames import Frames, recognise_scene
from hapticvlm.session.hands import Hand, Hold
from hapticvlm.session.overrides import MaterialOverrides, with_materials
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.scene_objects import title_of
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import (
    ObjectTarget,
    RecognitionRequest,
    RequestId,
    Surroundings,
    TextureTarget,
    ThingTarget,
    of_object,
)
from hapticvlm.session.touch import PlateTarget, TouchTracker, check_touch

MAX_TEXTURE_PX = 512  # a side; clients send 256


class SceneSession:
    """The scene of one connection: its model, and the hands that touch it."""

    def __init__(self, settings: SessionSettings, hold: Hold | None = None) -> None:
        """Begin a session; all sessions of a service share `hold`, so that none undoes a stop."""
        self.owner = settings.owner
        self.observer = settings.observer
        self._overrides = MaterialOverrides(settings.saved_materials)
        self._model = SceneModel(settings)
        self._frames = Frames()
        self._told: set[str] = set()  # fields of touches that were named as changed
        plate = PlateTarget(settings.reading, settings.plate_resistance, settings.thermal_gain)
        self._touches = TouchTracker(self._model, self._frames, hold or Hold(), plate)

    @property
    def model(self) -> SceneModel:
        """The model of the scene, to be read and not changed."""
        return self._model

    @property
    def materials(self) -> tuple[str, ...]:
        """The materials that this scene's objects may have."""
        return self._model.materials

    def name(self, object_id: str | None, surface: int | None = None) -> str | None:
        """Return what the scene calls this object or surface of it, if it gave it a name."""
        facts = None if object_id is None else self._model.objects.facts(ObjectTarget(object_id))
        return None if facts is None else title_of(facts, surface or 0)

    @property
    def overrides(self) -> MaterialOverrides:
        """Materials that a person set by hand of this scene's objects."""
        return self._overrides

    def override(self, scene: Scene, now: float) -> list[Action]:
        """Apply the materials that an observer states of this scene's objects.

        Returns the actions without the reply, which the observer gets and not this connection.
        Raises MessageError, before anything has changed, for an unknown object or material.
        """
        _, *actions = self.receive(with_materials(scene, self._model.objects.given), now)
        self._overrides = self._overrides.with_stated(scene.objects)
        return actions

    @property
    def leases(self) -> int:
        """Number of hands that hold a lease."""
        return self._touches.hands.leases

    @property
    def touching(self) -> Hand | None:
        """The hand of the latest contact, while it touches."""
        hand = self._touches.hands.on_plate
        return hand if hand is not None and hand.is_touching else None

    @property
    def late_contacts(self) -> int:
        """Number of contacts that made no impact because they came too late."""
        return self._touches.late_contacts

    def receive(
        self, message: ClientMessage, now: float, left_out: Sequence[LeftOut] = ()
    ) -> list[Action]:
        """Receive one message; raises MessageError if it is refused.

        `left_out` are the parts of it that its reader left out or changed. The answer names them:
        for a scene all of them, for touches each kind once.
        """
        actions = self._carry_out(message, now)
        if isinstance(message, Touch):
            left_out = [part for part in left_out if part.path not in self._told]
            self._told.update(part.path for part in left_out)
        return [_with_left_out(action, left_out) for action in actions] if left_out else actions

    def _carry_out(self, message: ClientMessage, now: float) -> list[Action]:
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
                text = "hello was sent already; open a new connection to start again"
                raise MessageError("protocol", text, path="$.type", id=message.id)

    def scene_view_received(
        self, request: RecognitionRequest, scene_view: SceneView | None, now: float
    ) -> list[Action]:
        """Receive the scene view; None: it has not changed."""
        view = self._model.surroundings.update_view(scene_view, now)
        return [] if view is None else [AskAmbient(request.picture, view)]

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Receive a VLM's answer; None: it has none."""
        surroundings = self._model.surroundings
        objects = self._model.objects
        surroundings.update(now)
        match ask, answer:
            case AskAmbient(), Reading():
                surroundings.add_reading(ask.view, answer, now)
            case AskAmbient(), _:
                surroundings.fail(ask.view)
            case AskMaterial(), Evidence() if ask.generation == objects.generation(ask.target):
                objects.add_reply(ask.target, answer)
        return self._touches.refresh()

    def recognised(
        self,
        request: RecognitionRequest,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive the evidence of a recognition; None: the picture has not changed."""
        target = request.target
        if isinstance(target, TextureTarget):
            return self._texture_read(target.texture, request, evidence, stages_ms, now)
        if request.reference_material is not None or isinstance(target, Surroundings):
            return []
        if request.generation != self._model.objects.generation(target):
            return skipped(request.reply_to, "superseded")
        if evidence is None:
            return skipped(request.reply_to, "unchanged")
        self._model.objects.add_recognition(target, evidence)
        has_changed = self._touches.changed_decision(target) is not None
        actions: list[Action] = []
        if request.reply_to is not None or has_changed:
            answer = msgspec.structs.replace(
                self._touches.decision(target),
                id=0 if request.reply_to is None else request.reply_to.value,
                stages_ms=stages_ms,
                frame_age_ms=self._frames.age_s(request.picture, now) * 1000.0,
            )
            actions.append(Reply(answer))
        texture = self._touches.refresh_texture(target)
        return [*actions, *texture, *self._model.question(request, now)]

    def _texture_read(
        self,
        texture: str,
        request: RecognitionRequest,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive what a texture map showed; announce the decisions that it changes."""
        objects = self._model.objects
        before = self._model.announced(objects.textures.surfaces_with(texture))
        if evidence is not None:
            objects.add_texture(texture, evidence)
        frame = request.picture
        target = of_object(frame.object_id, frame.surface)
        actions: list[Action] = []
        if objects.textures.texture_of(target) != texture:
            actions += skipped(request.reply_to, "superseded")
        elif request.reply_to is not None:
            before.pop(target, None)
            self._touches.changed_decision(target)  # it is announced by the answer
            answer = msgspec.structs.replace(
                self._touches.decision(target),
                id=request.reply_to.value,
                stages_ms=stages_ms,
                frame_age_ms=self._frames.age_s(frame, now) * 1000.0,
            )
            actions += [Reply(answer), *self._touches.refresh_texture(target)]
        changed = self._touches.announce_changes(before)
        return [*actions, *self._touches.refresh(), *changed]

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Whether the frame has outlived its own `max_age_ms`."""
        return self._frames.is_stale(frame, now)

    def is_uncached(self, request: RecognitionRequest) -> bool:
        """Whether to recognise even an unchanged picture: nothing is kept of what it shows."""
        target = request.target
        if isinstance(target, Surroundings | TextureTarget):
            return False
        return not self._model.objects.is_recognised(target)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """End leases that lapsed and move the plate; call at 50 Hz or so while owner."""
        self._model.surroundings.update(now)
        actions = self._touches.tick(now, reading)
        wanted = self._model.objects.wanted_textures()
        return [*actions, Reply(Textures(id=0, hashes=wanted))] if wanted else actions

    def set_owner(self, *, owner: bool, thermal_gain: float | None = None) -> None:
        """Set whether this scene may drive the outputs from now on, and the gain it finds set."""
        self.owner = owner
        if thermal_gain is not None:
            self._touches.plate.gain = thermal_gain

    def rest(self) -> None:
        """Drop every lease: the outputs were put to rest from outside."""
        self._touches.hands.release()

    def _frame(self, frame: Frame, now: float) -> list[Action]:
        check_describes(frame, observer=self.observer)
        if not self._model.objects.has_surface(of_object(frame.object_id, frame.surface)):
            text = "$.surface: the object states no surface with this index; state the object first"
            raise MessageError("message", text, path="$.surface", id=frame.id)
        if not self._frames.admits(frame, now):
            return skipped(RequestId(frame.id), "rate")
        if frame.purpose == "texture":
            return self._texture(frame, now)
        touched: list[Action] = []
        if frame.purpose == "live":
            touched = self._touches.recognise_again()
            if self._model.surroundings.wants_scene_view(now):
                touched.append(recognise_scene(frame))
        return [*touched, *self._answer_frame(frame, now)]

    def _texture(self, frame: Frame, now: float) -> list[Action]:
        """Read a texture map, or answer at once if it was read. Raises MessageError."""
        target = of_object(frame.object_id, frame.surface)
        texture = self._model.objects.textures.texture_of(target)
        if texture is None:
            text = (
                "$.surface: no texture is known of this surface; state `texture` of the object's "
                "surfaces in a scene first, and name `object_id` and `surface` here"
            )
            raise MessageError("message", text, path="$.surface", id=frame.id)
        check_texture(frame)
        textures = self._model.objects.textures
        if textures.evidence_of(target) is not None:
            return [self._kept_answer(frame, target, now)]
        if not textures.may_read(texture):
            return skipped(RequestId(frame.id), "rate")
        return [RecognitionRequest(TextureTarget(texture), frame, RequestId(frame.id))]

    def _answer_frame(self, frame: Frame, now: float) -> list[Action]:
        """Answer at once what needs no recognition, else recognise the frame."""
        target = of_object(frame.object_id, frame.surface)
        objects = self._model.objects
        if not isinstance(target, ObjectTarget) or objects.needs_recognition(target):
            generation = objects.generation(target)
            reply_to = RequestId(frame.id)
            scene = objects.scene_number
            return [RecognitionRequest(target, frame, reply_to, generation, scene=scene)]
        answer = self._kept_answer(frame, target, now)
        return [answer, *self._model.reference_request(frame, target)]

    def _kept_answer(self, frame: Frame, target: ThingTarget, now: float) -> Reply:
        """Answer a frame by the decision on what it shows, without a recognition."""
        cached = self._model.has_verdict(target)
        age_ms = self._frames.age_s(frame, now) * 1000.0
        decision = self._touches.decision(target)
        answer = msgspec.structs.replace(decision, id=frame.id, cached=cached, frame_age_ms=age_ms)
        return Reply(answer)

    def _scene(self, scene: Scene) -> list[Action]:
        check_describes(scene, observer=self.observer)
        updated = () if scene.replace else scene.objects
        objects = self._model.objects
        announced = self._model.announced(
            surface for given in updated for surface in objects.surfaces_known(given.object_id)
        )
        self._model.declare(scene)
        if scene.replace:
            self._overrides = self._overrides.without_stated()
        changed = self._touches.announce_changes(
            {target: key for target, key in announced.items() if objects.has_surface(target)}
        )
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


def _with_left_out(action: Action, left_out: Sequence[LeftOut]) -> Action:
    """Name the parts that were left out in an `ok`; other actions stay as they are."""
    if not isinstance(action, Reply) or not isinstance(action.message, Ok):
        return action
    named = [*left_out, *(action.message.left_out or ())]
    return Reply(msgspec.structs.replace(action.message, left_out=named))


def skipped(reply_to: RequestId | None, reason: SkipReason) -> list[Action]:
    """Answer the message that waits, if one does, that its frame was not recognised."""
    return [] if reply_to is None else [Reply(Skipped(id=reply_to.value, reason=reason))]


def check_describes(message: Frame | Scene, *, observer: bool) -> None:
    """Refuse a frame or a scene of an observer. Raises MessageError."""
    if not observer:
        return
    what = "send no frames" if isinstance(message, Frame) else "describe no scene"
    text = f"observers {what}; connect with role scene"
    raise MessageError("protocol", text, path="$.type", id=message.id)


def check_texture(frame: Frame) -> None:
    """Refuse a texture map that would keep the recogniser from live frames. Raises MessageError."""
    for path, side in (("$.width", frame.width), ("$.height", frame.height)):
        if side > MAX_TEXTURE_PX:
            text = f"{path}: {side} px; a texture has at most {MAX_TEXTURE_PX}, send a smaller copy"
            raise MessageError("limit", text, path=path, id=frame.id)


def check_set(wanted: Set, *, owner: bool, observer: bool) -> None:
    """Refuse settings that are not this connection's. Raises MessageError."""
    if wanted.watch is not None and not observer:
        text = "$.watch: only observers watch; connect with role observer"
        raise MessageError("protocol", text, path="$.watch", id=wanted.id)
    if wanted.ambient_c is not None and observer:
        text = "$.ambient_c: observers have no scene; connect with role scene"
        raise MessageError("protocol", text, path="$.ambient_c", id=wanted.id)
    if not owner and wanted.feel is not None:
        text = "$.feel: another scene owns the outputs; only their owner gets vibration events"
        raise MessageError("not_owner", text, path="$.feel", id=wanted.id)
    if not owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
        text = "another scene owns the outputs; only their owner sets gains"
        raise MessageError("not_owner", text, path="$", id=wanted.id)
