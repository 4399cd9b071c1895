"""SceneSession: the protocol's state machine for one connection. Does no I/O and reads no clock.

Feed it messages, looks and ticks with the time; carry out the actions it returns, in order. A
message that is wrong raises MessageError before anything has changed.
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from hapticvlm.messages import (
    FRAMES_PER_S,
    ClientMessage,
    Decision,
    Frame,
    Hello,
    MessageError,
    Ok,
    Scene,
    Set,
    Skipped,
    SkipReason,
    Stop,
    Touch,
)
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.recognition import pictures
from hapticvlm.recognition.ambient import ambient
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.rendering import thermal
from hapticvlm.rendering.thermal import PlateReading
from hapticvlm.rendering.voices import Command
from hapticvlm.session import decisions
from hapticvlm.session.actions import (
    Action,
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
from hapticvlm.session.clock import ClockOffset, FrameRate
from hapticvlm.session.hands import LEASE_S, Hand, Hold
from hapticvlm.session.objects import Key, SceneObjects

HANDS = {"left": 0, "right": 1}
NEUTRAL_HOLD_S = 30.0  # between touches the plate is kept neutral, not left to cool to the room


class SceneSession:
    """One connection's scene: objects, decisions, hands and their leases."""

    def __init__(self, *, owner: bool, observer: bool = False, hold: Hold | None = None) -> None:
        self.owner = owner
        self.observer = observer
        self._hold = hold if hold is not None else Hold()
        self._objects = SceneObjects()
        self._hands = {name: Hand(number) for name, number in HANDS.items()}
        self._latest_hand: Hand | None = None
        self._clock = ClockOffset()
        self._rate = FrameRate(FRAMES_PER_S)
        self._newest: Frame | None = None
        self._ambient_c: float | None = None
        self._thermal_gain = 1.0
        self._setpoint_c = NEUTRAL_C
        self._is_driving = False
        self._touched_at = float("-inf")
        self._ticked_at: float | None = None
        self._announced: dict[Key, Decision] = {}
        self._onsets = 0

    @property
    def leases(self) -> int:
        """How many hands hold a lease."""
        return sum(hand.is_active for hand in self._hands.values())

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Take in one message; raises MessageError if it is refused."""
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

    def recognised(
        self, frame: Frame, evidence: Evidence | None, stages_ms: dict[str, float], now: float
    ) -> list[Action]:
        """Take in what a look at `frame` gave; None means its picture has not changed."""
        if evidence is None:
            return self.skipped(frame, "unchanged")
        key = frame.object_id
        self._objects.see(key, evidence, enrol=frame.purpose == "enrol")
        decision = self._decision(key, cached=False)
        age_ms = self.age_s(frame, now) * 1000.0
        reply = msgspec.structs.replace(
            decision, id=frame.id, stages_ms=stages_ms, frame_age_ms=age_ms
        )
        is_news = self._is_news(key, decision)
        actions: list[Action] = [Reply(reply)] if frame.id or is_news else []
        actions += [
            Feel(self._command(hand, onset=False))
            for hand in self._hands.values()
            if hand.is_touching and hand.key == key
        ]
        return self._allowed(actions)

    def skipped(self, frame: Frame, reason: SkipReason) -> list[Action]:
        """Say that `frame` was not looked at."""
        return [Reply(Skipped(id=frame.id, reason=reason))] if frame.id else []

    def age_s(self, frame: Frame, now: float) -> float:
        """Return how old the frame is, by the client's own clock."""
        return self._clock.age_s(frame.captured_at, now)

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Tell whether the frame has outlived its own `max_age_ms`."""
        return frame.max_age_ms is not None and self.age_s(frame, now) * 1000.0 > frame.max_age_ms

    def wants_anew(self, frame: Frame) -> bool:
        """Tell whether to look even if the picture is unchanged: nothing is remembered of it."""
        return frame.id == 0 or not self._objects.is_seen(frame.object_id)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Let leases lapse and follow the plate's course; call at 50 Hz or so while owner."""
        actions: list[Action] = []
        for hand in self._hands.values():
            if hand.lease_until is not None and hand.lease_until < now:
                hand.let_go()
                actions.append(LetGo(hand.number))
        elapsed = 0.0 if self._ticked_at is None else max(0.0, now - self._ticked_at)
        self._ticked_at = now
        return actions + self._heat(now, elapsed, reading)

    def rest(self) -> None:
        """Drop every lease: the outputs were put to rest from outside."""
        for hand in self._hands.values():
            hand.let_go()

    def _touch(self, touch: Touch, now: float) -> list[Action]:
        self._check_touch(touch)
        self._clock.observe(touch.captured_at, now)
        self._hold.follow(touch)
        hand = self._hands[touch.hand]
        done = Reply(Ok(id=touch.id))
        if touch.phase == "release":
            hand.let_go()
            return [LetGo(hand.number), done]
        if self._hold.holds_all:
            text = "outputs are held by stop: send release, then a new approach or contact"
            raise MessageError("unsafe", text, path="$.phase", id=touch.id)
        was_touching = hand.is_touching
        onset = hand.follow(touch, now)
        self._latest_hand, self._touched_at = hand, now
        actions: list[Action] = []
        if hand.is_touching or touch.interaction == "swing":
            actions.append(Feel(self._command(hand, onset=onset)))
        elif was_touching:
            actions.append(LetGo(hand.number))
        return [*self._allowed(actions), done, *self._news(hand, begins=onset or not was_touching)]

    def _check_touch(self, touch: Touch) -> None:
        if not self.owner:
            text = "another scene owns the outputs; this connection may watch and recognise only"
            raise MessageError("not_owner", text, path="$.type", id=touch.id)
        needs_target = touch.phase != "release" and touch.interaction != "swing"
        if needs_target and touch.object_id is None and touch.region is None:
            text = "$: a touch needs `object_id` or `region`; add one"
            raise MessageError("message", text, path="$.object_id", id=touch.id)

    def _news(self, hand: Hand, *, begins: bool) -> Iterator[Action]:
        """Yield what the touch makes known: a decision event, or a look at the touched region."""
        if hand.key is None and hand.region is not None and begins and self._newest is not None:
            touched = msgspec.structs.replace(
                self._newest, id=0, object_id=None, region=hand.region, mask=None
            )
            yield LookAt(touched)
        decision = self._decision(hand.key, cached=self._objects.is_decided(hand.key))
        if self._is_news(hand.key, decision):
            pattern = _pattern(decision.material, hand)
            yield Reply(msgspec.structs.replace(decision, pattern=pattern))

    def _is_news(self, key: Key, decision: Decision) -> bool:
        as_new = msgspec.structs.replace(decision, cached=False)
        if self._announced.get(key) == as_new:
            return False
        self._announced[key] = as_new
        return True

    def _command(self, hand: Hand, *, onset: bool) -> Command:
        material = self._objects.verdict(hand.key).material
        self._onsets += onset
        assert hand.lease_until is not None
        return Command(
            hand=hand.number,
            material=decisions.known(material),
            interaction=hand.interaction or ("strike" if onset else "slide"),
            onset=onset,
            stroke=hand.stroke,
            seed=self._onsets,
            expires_at=hand.lease_until,
        )

    def _allowed(self, actions: list[Action]) -> list[Action]:
        if self._hold.holds("speaker"):
            return [action for action in actions if not isinstance(action, Feel)]
        return actions

    def _heat(self, now: float, elapsed: float, reading: PlateReading) -> list[Action]:
        hand = self._plate_hand()
        contact = self._contact(hand.key) if hand else None
        if self._hold.holds("peltier") or not 0.0 <= now - self._touched_at <= NEUTRAL_HOLD_S:
            was_driving, self._is_driving = self._is_driving, False
            return [RestPlate()] if was_driving else []
        wanted = NEUTRAL_C
        if hand is not None and contact is not None:
            since = None if hand.contact_at is None else now - hand.contact_at + thermal.LEAD_S
            wanted = thermal.wanted_c(contact, since, self._thermal_gain)
        if not self._is_driving and reading.plate_c is not None:
            low, high = thermal.SETPOINT_MIN_C, thermal.SETPOINT_MAX_C
            self._setpoint_c = min(max(reading.plate_c, low), high)
        self._is_driving = True
        limited = thermal.limit(wanted, self._setpoint_c, elapsed, reading)
        self._setpoint_c = limited.setpoint_c
        return [Heat(limited.setpoint_c, LEASE_S)]

    def _plate_hand(self) -> Hand | None:
        latest = self._latest_hand
        if latest is not None and latest.is_active:
            return latest
        return next((hand for hand in self._hands.values() if hand.is_active), None)

    def _contact(self, key: Key) -> thermal.ThermalContact | None:
        verdict = self._objects.verdict(key)
        return decisions.contact(verdict, self._objects.facts(key), ambient(self._ambient_c))

    def _decision(self, key: Key, *, cached: bool) -> Decision:
        verdict, facts = self._objects.verdict(key), self._objects.facts(key)
        gain = self._thermal_gain
        return decisions.describe(key, verdict, facts, ambient(self._ambient_c), gain, cached)

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
        self._newest = frame
        if frame.object_id is not None and not self._objects.needs_look(frame.object_id):
            cached = self._objects.is_decided(frame.object_id)
            decision = self._decision(frame.object_id, cached=cached)
            age_ms = self.age_s(frame, now) * 1000.0
            return [Reply(msgspec.structs.replace(decision, id=frame.id, frame_age_ms=age_ms))]
        return [LookAt(frame)]

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
            self._ambient_c = scene.ambient_c
        return [Reply(Ok(id=scene.id)), *self._refeel()]

    def _set(self, wanted: Set) -> list[Action]:
        actions: list[Action] = []
        if wanted.watch is not None:
            if not self.observer:
                text = "$.watch: only observers watch; connect with role observer"
                raise MessageError("protocol", text, path="$.watch", id=wanted.id)
            actions.append(Watch(frozenset(wanted.watch)))
        if not self.owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
            text = "another scene owns the outputs; only their owner sets gains"
            raise MessageError("not_owner", text, path="$", id=wanted.id)
        if wanted.ambient_c is not None:
            self._ambient_c = wanted.ambient_c
        if wanted.thermal_gain is not None:
            self._thermal_gain = wanted.thermal_gain
        if wanted.vibration_gain is not None:
            actions.append(SetGain(wanted.vibration_gain))
        return [*actions, Reply(Ok(id=wanted.id)), *self._refeel()]

    def _refeel(self) -> Iterator[Action]:
        """Yield what changes for the hands after the scene or a setting changed."""
        for hand in self._hands.values():
            if hand.is_touching:
                yield from self._allowed([Feel(self._command(hand, onset=False))])
                yield from self._news(hand, begins=False)


def _pattern(material: str, hand: Hand) -> str | None:
    if decisions.known(material) is None or not (hand.is_touching or hand.interaction):
        return None
    return f"{material} {hand.interaction or 'strike'}"
