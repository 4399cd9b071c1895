"""From what the hands of one scene do to what the outputs do: leases, vibration, plate.

The plate follows the hand of the latest contact, within limits, and never jumps. Between touches it
is kept neutral for a while and then released.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import msgspec

from hapticvlm.messages import Decision, LeftOut, MessageError, Ok, Touch
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat import limits as plate_limits
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE, ThermalContact
from hapticvlm.rendering.heat.limits import AT_REST, Delay, PlateReading, Strongest, limits_of
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm.rendering.vibration.vibration import IMPACTS
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session import decisions
from hapticvlm.session.actions import (
    Action,
    DrivePlate,
    PlayVibration,
    ReleaseHand,
    Reply,
    RestPlate,
)
from hapticvlm.session.frames import LATE_S, Frames
from hapticvlm.session.hands import LEASE_S, Hand, Hands, Hold
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.targets import HandRegion, ThingTarget, whole

LATE_PART = LeftOut(
    path="captured_at",
    text=f"the contact arrived more than {LATE_S:g} s after its capture: its impact is not played; "
    "send touches at once, with the time of their capture",
)
NEUTRAL_HOLD_S = 30.0  # between touches the plate is kept neutral, not left to cool to the room


class PlateTarget:
    """The trajectory of the skin and the setpoint that moves there; `gain` is 0..1."""

    def __init__(
        self,
        reading: PlateReading = AT_REST,
        plate_resistance: float = PLATE_RESISTANCE,
        gain: float = 1.0,
    ) -> None:
        self.reading = reading
        self.limits = limits_of(reading)
        self.gain = gain
        self._trajectory = ThermalTrajectory(plate_resistance=plate_resistance)
        self._setpoint_c = NEUTRAL_C
        self._strongest = Strongest()
        self._delay = Delay()
        self._is_driving = False
        self._ticked_at: float | None = None

    def elapse(self, now: float, reading: PlateReading) -> float:
        """Receive what the plate reports; return the time since the last call, s."""
        self.reading = reading
        self.limits = limits_of(reading)
        elapsed = 0.0 if self._ticked_at is None else max(0.0, now - self._ticked_at)
        self._ticked_at = now
        return elapsed

    def rest(self, now: float) -> list[Action]:
        """Release the plate, once."""
        self._trajectory = self._trajectory.release(now)
        was_driving = self._is_driving
        self._is_driving = False
        return [RestPlate()] if was_driving else []

    def update(
        self, hand: Hand | None, contact: ThermalContact | None, now: float, elapsed: float
    ) -> list[Action]:
        """Go on with what this hand does now; None = no hand holds a lease."""
        self._trajectory = self._after(hand, contact, now)
        waits = hand is not None and not hand.is_touching and self._trajectory.begun_at is None
        wanted = self._trajectory.target_c(now, self.gain)
        if hand is not None and waits:
            most_c = hand.lead_limit_c(now)
            wanted = min(max(wanted, NEUTRAL_C - most_c), NEUTRAL_C + most_c)
        if not self._is_driving and self.reading.plate_c is not None:
            self._setpoint_c = plate_limits.within_range(self.reading.plate_c).setpoint_c
            self._strongest = Strongest(self._setpoint_c, self._setpoint_c)
            self._delay = Delay()
        self._is_driving = True
        strength = self._trajectory.strength
        strongest = self._strongest.towards(wanted, strength, elapsed, self.reading)
        is_felt = self._trajectory.begun_at is not None
        self._delay = self._delay.after(wanted, elapsed, self.reading) if is_felt else Delay()
        wanted -= plate_limits.CATCH_UP * self._delay.behind_c
        limited = plate_limits.limit(
            wanted, self._setpoint_c, elapsed, self.reading, strength=strength, strongest=strongest
        )
        self._strongest = strongest
        self._setpoint_c = limited.setpoint_c
        return [DrivePlate(limited.setpoint_c, LEASE_S)]

    def _after(
        self, hand: Hand | None, contact: ThermalContact | None, now: float
    ) -> ThermalTrajectory:
        """Continue the trajectory.

        A region of a frame does not show where an object ends: another material is another object.
        """
        if hand is None:
            return self._trajectory.release(now)
        if not hand.is_touching:
            return self._trajectory.approach(contact, now, leads=hand.lead_limit_c(now) > 0.0)
        bulk = contact.thermal if contact and isinstance(hand.target, HandRegion) else None
        return self._trajectory.touch(contact, (hand.name, hand.target, bulk), now)


def check_touch(touch: Touch, *, owner: bool) -> None:
    """Refuse a touch of another than the owner, and one of nothing. Raises MessageError."""
    if not owner:
        text = "another scene owns the outputs; this connection may watch and recognise only"
        raise MessageError("not_owner", text, path="$.type", id=touch.id)
    needs_target = touch.phase != "release" and touch.interaction != "swing"
    if needs_target and touch.object_id is None and touch.region is None:
        text = "$: a touch needs `object_id` or `region`; add one"
        raise MessageError("message", text, path="$.object_id", id=touch.id)


class TouchTracker:
    """The hands of one scene and the plate they share; what they touch is in `scene`."""

    def __init__(self, scene: SceneModel, frames: Frames, hold: Hold, plate: PlateTarget) -> None:
        self.hands = Hands()
        self.plate = plate
        self.late_contacts = 0  # that made no impact because they came too late
        self._scene = scene
        self._frames = frames
        self._hold = hold
        self._onsets = 0
        self._touched_at = float("-inf")

    def receive(self, touch: Touch, now: float) -> list[Action]:
        """Receive one touch of the owner. Raises MessageError while a stop holds both outputs."""
        self._frames.observe_touch(touch, now)
        self._hold.update(touch)
        hand = self.hands[touch.hand]
        if touch.phase == "release":
            hand.release(now)
            return [ReleaseHand(hand.number), Reply(Ok(id=touch.id))]
        if self._hold.holds_all(touch.hand):
            text = "outputs are held by stop: send release, then a new approach or contact"
            raise MessageError("unsafe", text, path="$.phase", id=touch.id)
        if touch.surface == 0:
            return self._move(hand, touch, now)
        touch, told = self._scene.on_stated_surface(touch)
        return [*self._move(hand, touch, now), *told]

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """End the leases that lapsed and move the plate along its trajectory."""
        lapsed: list[Action] = [ReleaseHand(hand.number) for hand in self.hands.lapse(now)]
        return lapsed + self._drive_plate(now, self.plate.elapse(now, reading))

    def decision(self, target: ThingTarget) -> Decision:
        """Return the decision on this, with the pattern of a hand on it."""
        decision = self._scene.decision(target, self.plate.gain, self.plate.limits)
        interaction = self.hands.interaction_on(target)
        return decisions.touched_as(decision, interaction, self._scene.rendition(target))

    def changed_decision(self, target: ThingTarget) -> Decision | None:
        """Return the decision on this if it differs from the one last announced, else None."""
        changed = self._scene.changed_decision(target, self.plate.gain, self.plate.limits)
        if changed is None:
            return None
        interaction = self.hands.interaction_on(target)
        return decisions.touched_as(changed, interaction, self._scene.rendition(target))

    def recognise_again(self) -> list[Action]:
        """Recognise the regions under the hands in the newest frame."""
        actions: list[Action] = []
        for hand in self.hands:
            if hand.is_touching:
                actions += self._recognise(hand)
        return actions

    def refresh(self) -> list[Action]:
        """Announce and play what changed for the hands after the scene or a setting changed.

        A hand on a surface that its object no longer states is on the largest one.
        """
        actions: list[Action] = []
        for hand in self.hands:
            if not self._scene.objects.has_surface(hand.target):
                hand.target = whole(hand.target)
            if hand.is_touching:
                actions += self.refresh_texture(hand.target)
                actions += self._announce(hand, cached=False)
        return actions

    def announce_changes(self, before: Mapping[ThingTarget, Hashable]) -> list[Action]:
        """Announce the decisions that differ from `before`, of objects that no hand touches."""
        touched = {hand.target for hand in self.hands if hand.is_touching}
        untouched = [target for target in before if target not in touched]
        changed = [(before[target], self.changed_decision(target)) for target in untouched]
        return [
            Reply(decision)
            for old, decision in changed
            if decision and decisions.change_key(decision) != old
        ]

    def refresh_texture(self, target: ThingTarget) -> list[Action]:
        """Render a rubbing hand's texture again; an impact that rings is left alone."""
        return [
            action
            for hand in self.hands
            if hand.vibrates and hand.is_sliding and hand.target == target
            for action in self._play(hand, onset=False)
        ]

    def _move(self, hand: Hand, touch: Touch, now: float) -> list[Action]:
        vibrated = hand.vibrates
        was_touching = hand.is_touching
        onset = hand.update(touch, now)
        is_late = onset and self._frames.is_late(touch, now)
        self.late_contacts += is_late
        self._touched_at = now
        begins = hand.is_touching and not was_touching
        if begins and isinstance(hand.target, HandRegion):
            self._scene.objects.forget(hand.target)
        had_verdict = self._scene.has_verdict(hand.target)
        actions: list[Action] = []
        if hand.vibrates and (hand.is_sliding or not is_late):
            actions += self._play(hand, onset=onset and not is_late)
        elif vibrated and not hand.vibrates:
            actions.append(ReleaseHand(hand.number))
        late = [LATE_PART] if is_late else None
        actions.append(Reply(Ok(id=touch.id, left_out=late)))
        actions += self._announce(hand, cached=had_verdict)
        return [*actions, *self._recognise(hand)] if begins else actions

    def _recognise(self, hand: Hand) -> list[Action]:
        objects = self._scene.objects
        generation = objects.generation(hand.target)
        return [*self._frames.recognise_region(hand, generation, objects.scene_number)]

    def _announce(self, hand: Hand, *, cached: bool) -> list[Action]:
        """Announce the decision on what a hand touches if it is new or changed."""
        changed = self.changed_decision(hand.target)
        if changed is None:
            return []
        return [Reply(msgspec.structs.replace(changed, cached=cached))]

    def _play(self, hand: Hand, *, onset: bool) -> list[Action]:
        if self._hold.holds("speaker", hand.name) or hand.lease_until is None:
            return []
        self._onsets += onset
        rendition = self._scene.rendition(hand.target)
        interaction = hand.interaction_name
        material, gain = rendition.impact if interaction in IMPACTS else rendition.texture
        command = Command(
            hand=hand.number,
            material=material,
            interaction=interaction,
            onset=onset,
            motion=hand.motion,
            seed=self._onsets,
            expires_at=hand.lease_until,
            gain=gain,
            thickness_m=self._scene.swung_m(hand.target) if interaction == "swing" else None,
            hum=self._scene.hum(hand.target) if hand.is_touching else None,
        )
        return [PlayVibration(command)]

    def _drive_plate(self, now: float, elapsed: float) -> list[Action]:
        hand = self.hands.on_plate
        is_held = self._hold.holds("peltier", hand.name if hand else None)
        is_idle = not 0.0 <= now - self._touched_at <= NEUTRAL_HOLD_S
        if is_held or is_idle:
            return self.plate.rest(now)
        contact = self._scene.contact(hand.target) if hand else None
        return self.plate.update(hand, contact, now, elapsed)
