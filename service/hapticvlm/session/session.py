"""SceneSession: the protocol's state machine for one connection. Does no I/O and reads no clock.

Feed it messages, looks and ticks with the time; carry out the actions it returns, in order. A
message that is wrong raises MessageError before anything has changed. An observer describes no
scene, and only the owner moves outputs.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

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
from hapticvlm.recognition.ambient import SceneView
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.vlm.answers import Reading
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    HoldAtRest,
    LookAt,
    Reply,
    SetGain,
    Watch,
)
from hapticvlm.session.frames import SURROUNDINGS, Frames, look_around
from hapticvlm.session.hands import Hold
from hapticvlm.session.plate_target import AT_REST
from hapticvlm.session.scene_model import World
from hapticvlm.session.touch import Touching


def check_describes(message: Frame | Scene, *, observer: bool) -> None:
    """Refuse a frame or a scene of an observer. Raises MessageError."""
    if not observer:
        return
    what = "send no frames" if isinstance(message, Frame) else "describe no scene"
    text = f"observers {what}; connect with role scene"
    raise MessageError("protocol", text, path="$.type", id=message.id)


def check_touch(touch: Touch, *, owner: bool) -> None:
    """Refuse a touch of another than the owner, and one of nothing. Raises MessageError."""
    if not owner:
        text = "another scene owns the outputs; this connection may watch and recognise only"
        raise MessageError("not_owner", text, path="$.type", id=touch.id)
    needs_target = touch.phase != "release" and touch.interaction != "swing"
    if needs_target and touch.object_id is None and touch.region is None:
        text = "$: a touch needs `object_id` or `region`; add one"
        raise MessageError("message", text, path="$.object_id", id=touch.id)


def check_set(wanted: Set, *, owner: bool, observer: bool) -> None:
    """Refuse settings that are not this connection's. Raises MessageError."""
    if wanted.watch is not None and not observer:
        text = "$.watch: only observers watch; connect with role observer"
        raise MessageError("protocol", text, path="$.watch", id=wanted.id)
    if wanted.ambient_c is not None and observer:
        text = "$.ambient_c: observers have no scene; connect with role scene"
        raise MessageError("protocol", text, path="$.ambient_c", id=wanted.id)
    if not owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
        text = "another scene owns the outputs; only their owner sets gains"
        raise MessageError("not_owner", text, path="$", id=wanted.id)


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
        can_ask: bool = False,
        contact_resistance: float | None = None,
    ) -> None:
        self.owner = owner
        self.observer = observer
        self._world = World(table, can_ask=can_ask, contact_resistance=contact_resistance)
        self._frames = Frames()
        held = hold if hold is not None else Hold()
        self._touching = Touching(self._world, self._frames, held, reading)

    @property
    def materials(self) -> tuple[str, ...]:
        """What this scene's objects may be made of."""
        return self._world.materials

    def name(self, object_id: str | None) -> str | None:
        """Return what the scene calls this object, if it gave it a name."""
        facts = None if object_id is None else self._world.objects.facts(object_id)
        return None if facts is None else facts.name

    @property
    def leases(self) -> int:
        """How many hands hold a lease."""
        return self._touching.hands.leases

    @property
    def late_contacts(self) -> int:
        """How many contacts made no impact because they came too late."""
        return self._touching.late_contacts

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Take in one message; raises MessageError if it is refused."""
        self._world.surroundings.follow(now)
        match message:
            case Touch():
                check_touch(message, owner=self.owner)
                return self._touching.follow(message, now)
            case Frame():
                return self._frame(message, now)
            case Scene():
                return self._scene(message)
            case Set():
                return self._set(message)
            case Stop():
                return [HoldAtRest(message.scope), Reply(Ok(id=message.id))]
            case Hello():
                text = "hello was already said; open a new connection to start again"
                raise MessageError("protocol", text, path="$.type", id=message.id)

    def sighted(self, look: LookAt, sight: SceneView | None, now: float) -> list[Action]:
        """Take in what the scene as a whole looks like; None means it has not changed."""
        view = None if sight is None else self._world.surroundings.see(sight, now)
        return [] if view is None else [AskAmbient(look.frame, view)]

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Take in what a VLM answered; None means it has no answer."""
        surroundings, objects = self._world.surroundings, self._world.objects
        surroundings.follow(now)
        match ask, answer:
            case AskAmbient(), Reading():
                surroundings.learn(ask.view, answer, now)
            case AskAmbient(), _:
                surroundings.fail(ask.view)
            case AskMaterial(), Evidence() if ask.generation == objects.generation(ask.key):
                objects.hear(ask.key, answer)
        return self._touching.renew()

    def recognised(
        self, look: LookAt, evidence: Evidence | None, stages_ms: dict[str, float], now: float
    ) -> list[Action]:
        """Take in what a look gave; None means its picture has not changed."""
        frame, key = look.frame, look.key
        if look.generation != self._world.objects.generation(key):
            return self.skipped(frame, "superseded")
        if evidence is None:
            return self.skipped(frame, "unchanged")
        self._world.objects.see(key, evidence)
        decision = self._touching.decision(key)
        is_news = self._world.is_news(key, decision)
        actions: list[Action] = []
        if frame.id or is_news:
            age_ms = self.age_s(frame, now) * 1000.0
            told = msgspec.structs.replace(
                decision, id=frame.id, stages_ms=stages_ms, frame_age_ms=age_ms
            )
            actions.append(Reply(told))
        return [*actions, *self._touching.refeel(key), *self._world.question(look, now)]

    def skipped(self, frame: Frame, reason: SkipReason) -> list[Action]:
        """Say that `frame` was not looked at."""
        return [Reply(Skipped(id=frame.id, reason=reason))] if frame.id else []

    def age_s(self, frame: Frame, now: float) -> float:
        """Return how old the frame is, by the client's own clock."""
        return self._frames.age_s(frame, now)

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Tell whether the frame has outlived its own `max_age_ms`."""
        return self._frames.is_stale(frame, now)

    def wants_anew(self, look: LookAt) -> bool:
        """Tell whether to look even if the picture is unchanged: nothing is remembered of it."""
        return look.key != SURROUNDINGS and not self._world.objects.is_seen(look.key)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Let leases lapse and follow the plate's course; call at 50 Hz or so while owner."""
        self._world.surroundings.follow(now)
        return self._touching.tick(now, reading)

    def rest(self) -> None:
        """Drop every lease: the outputs were put to rest from outside."""
        self._touching.hands.let_go()

    def held(self, scope: Scope) -> None:
        """Note that outputs were stopped; the hold itself is shared by all sessions."""

    def _frame(self, frame: Frame, now: float) -> list[Action]:
        check_describes(frame, observer=self.observer)
        if not self._frames.admits(frame, now):
            return self.skipped(frame, "rate")
        touched: list[Action] = []
        if frame.purpose == "live":
            touched = self._touching.look_again()
            if self._world.surroundings.wants_sight(now):
                touched.append(look_around(frame))
        return [*touched, *self._answer_frame(frame, now)]

    def _answer_frame(self, frame: Frame, now: float) -> list[Action]:
        """Answer at once what needs no look, else have the frame looked at."""
        key, objects = frame.object_id, self._world.objects
        if key is None or objects.needs_look(key):
            return [LookAt(frame, key, objects.generation(key))]
        cached = objects.is_decided(key)
        age_ms = self.age_s(frame, now) * 1000.0
        decision = self._touching.decision(key)
        told = msgspec.structs.replace(decision, id=frame.id, cached=cached, frame_age_ms=age_ms)
        return [Reply(told)]

    def _scene(self, scene: Scene) -> list[Action]:
        check_describes(scene, observer=self.observer)
        self._world.declare(scene)
        return [Reply(Ok(id=scene.id)), *self._touching.renew()]

    def _set(self, wanted: Set) -> list[Action]:
        check_set(wanted, owner=self.owner, observer=self.observer)
        if wanted.feel is not None:
            text = "$.feel: this service sends no vibration events yet"
            raise MessageError("message", text, path="$.feel", id=wanted.id)
        actions: list[Action] = []
        if wanted.watch is not None:
            actions.append(Watch(frozenset(wanted.watch)))
        if wanted.ambient_c is not None:
            self._world.surroundings.scene_c = wanted.ambient_c
        if wanted.thermal_gain is not None:
            self._touching.drive.gain = wanted.thermal_gain
        if wanted.vibration_gain is not None:
            actions.append(SetGain(wanted.vibration_gain))
        return [*actions, Reply(Ok(id=wanted.id)), *self._touching.renew()]
