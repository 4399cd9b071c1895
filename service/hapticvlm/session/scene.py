"""SceneSession: the protocol's state machine for one connection. Does no I/O and reads no clock.

Feed it messages, looks and ticks with the time; carry out the actions it returns, in order. A
message that is wrong raises MessageError before anything has changed.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from hapticvlm.materials import MATERIALS, Material
from hapticvlm.messages import (
    FRAMES_PER_S,
    ClientMessage,
    Decision,
    Frame,
    Hello,
    MessageError,
    Ok,
    Region,
    Scene,
    Scope,
    Set,
    Skipped,
    SkipReason,
    Stop,
    Touch,
)
from hapticvlm.recognition import pictures
from hapticvlm.recognition.ambient import Sight
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.vlm.answers import Reading
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.rendering.thermal import ThermalContact
from hapticvlm.rendering.voices import Command
from hapticvlm.session import decisions
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    Feel,
    HoldAtRest,
    LetGo,
    LookAt,
    Reply,
    SetGain,
    Watch,
)
from hapticvlm.session.clock import ClockOffset, FrameRate
from hapticvlm.session.drive import AT_REST, PlateDrive
from hapticvlm.session.hands import LEASE_S, NAMES, Hand, Hold
from hapticvlm.session.objects import Key, SceneObjects
from hapticvlm.session.surroundings import Surroundings

LATE_S = LEASE_S  # a contact captured longer ago lapsed on its way; nobody takes it for its cause
WHOLE = Region(x=0.0, y=0.0, w=1.0, h=1.0)
SURROUNDINGS: Key = ("scene", "scene")


class SceneSession:
    """One connection's scene: objects, decisions, hands and their leases."""

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
        self.late_contacts = 0  # that made no impact because they came too late
        self._hold = hold if hold is not None else Hold()
        self._table = table
        self._contact_resistance = contact_resistance
        self._objects = SceneObjects(table)
        self._hands = {name: Hand(number) for number, name in enumerate(NAMES)}
        self._clock = ClockOffset()
        self._rate = FrameRate(FRAMES_PER_S)
        self._newest: Frame | None = None
        self._surroundings = Surroundings(can_ask=can_ask)
        self._can_ask = can_ask
        self._drive = PlateDrive(reading)
        self._onsets = 0

    @property
    def materials(self) -> tuple[str, ...]:
        """What this scene's objects may be made of."""
        return tuple(self._table)

    @property
    def leases(self) -> int:
        """How many hands hold a lease."""
        return sum(hand.is_active for hand in self._hands.values())

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Take in one message; raises MessageError if it is refused."""
        self._surroundings.follow(now)
        match message:
            case Touch():
                return self._touch(message, now)
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

    def sighted(self, look: LookAt, sight: Sight | None, now: float) -> list[Action]:
        """Take in what the scene as a whole looks like; None means it has not changed."""
        view = None if sight is None else self._surroundings.see(sight, now)
        return [] if view is None else [AskAmbient(look.frame, view)]

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Take in what a VLM answered; None means it has no answer."""
        self._surroundings.follow(now)
        match ask, answer:
            case AskAmbient(), Reading():
                self._surroundings.learn(ask.view, answer, now)
            case AskAmbient(), _:
                self._surroundings.fail(ask.view)
            case AskMaterial(), Evidence() if ask.generation == self._objects.generation:
                self._objects.hear(ask.key, answer)
        return self._renew()

    def recognised(
        self, look: LookAt, evidence: Evidence | None, stages_ms: dict[str, float], now: float
    ) -> list[Action]:
        """Take in what a look gave; None means its picture has not changed."""
        frame, key = look.frame, look.key
        if look.generation != self._objects.generation:
            return self.skipped(frame, "superseded")
        if evidence is None:
            return self.skipped(frame, "unchanged")
        self._objects.see(key, evidence)
        decision = self._decision(key)
        is_news = self._objects.is_news(key, decisions.gist(decision))
        actions: list[Action] = []
        if frame.id or is_news:
            age_ms = self.age_s(frame, now) * 1000.0
            actions.append(
                Reply(
                    msgspec.structs.replace(
                        decision, id=frame.id, stages_ms=stages_ms, frame_age_ms=age_ms
                    )
                )
            )
        return [*actions, *self._refeel(key), *self._ask_after(look, now)]

    def skipped(self, frame: Frame, reason: SkipReason) -> list[Action]:
        """Say that `frame` was not looked at."""
        return [Reply(Skipped(id=frame.id, reason=reason))] if frame.id else []

    def age_s(self, frame: Frame, now: float) -> float:
        """Return how old the frame is, by the client's own clock."""
        return self._clock.age_s(frame.captured_at, now)

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Tell whether the frame has outlived its own `max_age_ms`."""
        return frame.max_age_ms is not None and self.age_s(frame, now) * 1000.0 > frame.max_age_ms

    def wants_anew(self, look: LookAt) -> bool:
        """Tell whether to look even if the picture is unchanged: nothing is remembered of it."""
        return look.key != SURROUNDINGS and not self._objects.is_seen(look.key)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Let leases lapse and follow the plate's course; call at 50 Hz or so while owner."""
        self._surroundings.follow(now)
        actions: list[Action] = []
        for hand in self._hands.values():
            if hand.lease_until is not None and hand.lease_until < now:
                hand.let_go()
                actions.append(LetGo(hand.number))
        return actions + self._heat(now, self._drive.elapse(now, reading))

    def rest(self) -> None:
        """Drop every lease: the outputs were put to rest from outside."""
        for hand in self._hands.values():
            hand.let_go()

    def held(self, scope: Scope) -> None:
        """Note that outputs were stopped; the hold itself is shared by all sessions."""

    def _touch(self, touch: Touch, now: float) -> list[Action]:
        self._check_touch(touch)
        self._clock.observe(touch.captured_at, now)
        self._hold.follow(touch)
        hand = self._hands[touch.hand]
        done = Reply(Ok(id=touch.id))
        if touch.phase == "release":
            hand.let_go()
            return [LetGo(hand.number), done]
        if self._hold.holds_all(touch.hand):
            text = "outputs are held by stop: send release, then a new approach or contact"
            raise MessageError("unsafe", text, path="$.phase", id=touch.id)
        was_felt, was_touching = hand.is_felt, hand.is_touching
        onset = hand.follow(touch, now)
        is_late = onset and self._is_late(touch, now)
        self.late_contacts += is_late
        self._drive.touched(now)
        begins = hand.is_touching and not was_touching
        if begins and isinstance(hand.key, tuple):
            self._objects.forget(hand.key)
        was_decided = self._objects.is_decided(hand.key)
        actions: list[Action] = []
        if hand.is_felt and (hand.rubs or not is_late):
            actions += self._feel(hand, onset=onset and not is_late)
        elif was_felt and not hand.is_felt:
            actions.append(LetGo(hand.number))
        actions.append(done)
        actions += self._news(hand, cached=was_decided)
        return [*actions, *self._look_at_region(hand)] if begins else actions

    def _is_late(self, touch: Touch, now: float) -> bool:
        return self._clock.runs and self._clock.age_s(touch.captured_at, now) > LATE_S

    def _check_touch(self, touch: Touch) -> None:
        if not self.owner:
            text = "another scene owns the outputs; this connection may watch and recognise only"
            raise MessageError("not_owner", text, path="$.type", id=touch.id)
        needs_target = touch.phase != "release" and touch.interaction != "swing"
        if needs_target and touch.object_id is None and touch.region is None:
            text = "$: a touch needs `object_id` or `region`; add one"
            raise MessageError("message", text, path="$.object_id", id=touch.id)

    def _look_at_region(self, hand: Hand) -> list[Action]:
        """Have the region a hand touches looked at in the newest frame."""
        if not isinstance(hand.key, tuple) or self._newest is None:
            return []
        touched = msgspec.structs.replace(
            self._newest, id=0, object_id=None, region=hand.region, mask=None, purpose="live"
        )
        return [LookAt(touched, hand.key, self._objects.generation)]

    def _look_around(self, frame: Frame, now: float) -> list[Action]:
        """Have the whole frame looked at, now and then, for what the place looks like."""
        if not self._surroundings.wants_sight(now):
            return []
        whole = msgspec.structs.replace(frame, id=0, object_id=None, region=WHOLE, mask=None)
        return [LookAt(whole, SURROUNDINGS, self._objects.generation)]

    def _ask_after(self, look: LookAt, now: float) -> list[Action]:
        """Have a VLM asked what a named object is made of that the encoder leaves unknown."""
        if not self._can_ask or not isinstance(look.key, str):
            return []
        if not self._objects.wants_telling(look.key, now):
            return []
        return [AskMaterial(look.frame, look.key, look.generation)]

    def _news(self, hand: Hand, *, cached: bool) -> list[Action]:
        """Tell the decision on what a hand touches if it is new or changed."""
        decision = self._decision(hand.key)
        if not self._objects.is_news(hand.key, decisions.gist(decision)):
            return []
        return [Reply(msgspec.structs.replace(decision, cached=cached))]

    def _feel(self, hand: Hand, *, onset: bool) -> list[Action]:
        if self._hold.holds("speaker", hand.name) or hand.lease_until is None:
            return []
        self._onsets += onset
        command = Command(
            hand=hand.number,
            material=decisions.known(self._objects.verdict(hand.key).material),
            interaction=hand.manner,
            onset=onset,
            stroke=hand.stroke,
            seed=self._onsets,
            expires_at=hand.lease_until,
        )
        return [Feel(command)]

    def _heat(self, now: float, elapsed: float) -> list[Action]:
        hand = self._plate_hand()
        is_held = self._hold.holds("peltier", hand.name if hand else None)
        if is_held or self._drive.is_idle(now):
            return self._drive.rest(now)
        contact = self._contact(hand.key) if hand else None
        return self._drive.follow(hand, contact, now, elapsed)

    def _plate_hand(self) -> Hand | None:
        """Return the hand of the latest contact; without one, a hand that approaches."""
        touching = [hand for hand in self._hands.values() if hand.is_touching]
        if touching:
            return max(touching, key=lambda hand: hand.contact_at or 0.0)
        return next((hand for hand in self._hands.values() if hand.is_active), None)

    def _contact(self, key: Key) -> ThermalContact | None:
        verdict = self._objects.verdict(key)
        facts = self._objects.facts(key)
        object_id = key if isinstance(key, str) else None
        warmth = decisions.surface_of(object_id, verdict, facts, self._surroundings.ambient)
        return decisions.contact(
            verdict, facts, warmth.value_c, self._table, self._contact_resistance
        )

    def _decision(self, key: Key) -> Decision:
        around = decisions.Circumstances(
            self._surroundings.ambient, self._drive.gain, self._drive.reading, self._table
        )
        object_id = key if isinstance(key, str) else None
        verdict, facts = self._objects.verdict(key), self._objects.facts(key)
        manner = next(
            (h.manner for h in self._hands.values() if h.is_active and h.key == key), None
        )
        return decisions.describe(object_id, verdict, facts, around, manner)

    def _frame(self, frame: Frame, now: float) -> list[Action]:
        if self.observer:
            text = "observers send no frames; connect with role scene"
            raise MessageError("protocol", text, path="$.type", id=frame.id)
        if not self._rate.admits(now):
            return self.skipped(frame, "rate")
        try:
            pictures.check_header(frame)
        except pictures.PictureError as error:
            raise MessageError("message", str(error), path=error.path, id=frame.id) from None
        self._clock.observe(frame.captured_at, now)
        touched: list[Action] = []
        if frame.purpose == "live":
            self._newest = frame
            for hand in self._hands.values():
                touched += self._look_at_region(hand) if hand.is_touching else []
            touched += self._look_around(frame, now)
        return [*touched, *self._answer_frame(frame, now)]

    def _answer_frame(self, frame: Frame, now: float) -> list[Action]:
        """Answer at once what needs no look, else have the frame looked at."""
        key = frame.object_id
        if key is None or self._objects.needs_look(key):
            return [LookAt(frame, key, self._objects.generation)]
        cached = self._objects.is_decided(key)
        age_ms = self.age_s(frame, now) * 1000.0
        decision = self._decision(key)
        return [
            Reply(
                msgspec.structs.replace(decision, id=frame.id, cached=cached, frame_age_ms=age_ms)
            )
        ]

    def _scene(self, scene: Scene) -> list[Action]:
        if self.observer:
            text = "observers describe no scene; connect with role scene"
            raise MessageError("protocol", text, path="$.type", id=scene.id)
        try:
            self._objects.declare(scene)
        except MessageError as error:
            error.id = scene.id
            raise
        if scene.ambient_c is not None:
            self._surroundings.scene_c = scene.ambient_c
        return [Reply(Ok(id=scene.id)), *self._renew()]

    def _set(self, wanted: Set) -> list[Action]:
        self._check_set(wanted)
        actions: list[Action] = []
        if wanted.watch is not None:
            actions.append(Watch(frozenset(wanted.watch)))
        if wanted.ambient_c is not None:
            self._surroundings.scene_c = wanted.ambient_c
        if wanted.thermal_gain is not None:
            self._drive.gain = wanted.thermal_gain
        if wanted.vibration_gain is not None:
            actions.append(SetGain(wanted.vibration_gain))
        return [*actions, Reply(Ok(id=wanted.id)), *self._renew()]

    def _check_set(self, wanted: Set) -> None:
        if wanted.watch is not None and not self.observer:
            text = "$.watch: only observers watch; connect with role observer"
            raise MessageError("protocol", text, path="$.watch", id=wanted.id)
        if wanted.ambient_c is not None and self.observer:
            text = "$.ambient_c: observers have no scene; connect with role scene"
            raise MessageError("protocol", text, path="$.ambient_c", id=wanted.id)
        if not self.owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
            text = "another scene owns the outputs; only their owner sets gains"
            raise MessageError("not_owner", text, path="$", id=wanted.id)

    def _renew(self) -> list[Action]:
        """Say and feel what changed for the hands after the scene or a setting changed."""
        actions: list[Action] = []
        for hand in self._hands.values():
            if hand.is_touching:
                actions += self._refeel(hand.key)
                actions += self._news(hand, cached=False)
        return actions

    def _refeel(self, key: Key) -> list[Action]:
        """Give a rubbing hand its texture anew; an impact that rings is left alone."""
        return [
            action
            for hand in self._hands.values()
            if hand.is_felt and hand.rubs and hand.key == key
            for action in self._feel(hand, onset=False)
        ]
