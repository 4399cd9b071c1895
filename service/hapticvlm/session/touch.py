"""From what the hands of one scene do to what the outputs do: leases, vibration, plate."""

from __future__ import annotations

import msgspec

from hapticvlm.messages import Decision, MessageError, Ok, Touch
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.rendering.voices import Command
from hapticvlm.session.actions import Action, Feel, LetGo, Reply
from hapticvlm.session.frames import Frames
from hapticvlm.session.hands import Hand, Hands, Hold
from hapticvlm.session.plate_target import PlateDrive
from hapticvlm.session.scene_model import World
from hapticvlm.session.scene_objects import Key


class Touching:
    """The hands of one scene and the plate they share; what they touch is in `world`."""

    def __init__(self, world: World, frames: Frames, hold: Hold, reading: PlateReading) -> None:
        self.hands = Hands()
        self.drive = PlateDrive(reading)
        self.late_contacts = 0  # that made no impact because they came too late
        self._world = world
        self._frames = frames
        self._hold = hold
        self._onsets = 0

    def follow(self, touch: Touch, now: float) -> list[Action]:
        """Take in one touch of the owner. Raises MessageError while a stop holds both outputs."""
        self._frames.hear(touch, now)
        self._hold.follow(touch)
        hand = self.hands[touch.hand]
        if touch.phase == "release":
            hand.let_go()
            return [LetGo(hand.number), Reply(Ok(id=touch.id))]
        if self._hold.holds_all(touch.hand):
            text = "outputs are held by stop: send release, then a new approach or contact"
            raise MessageError("unsafe", text, path="$.phase", id=touch.id)
        return self._move(hand, touch, now)

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Let leases lapse and follow the plate's course."""
        lapsed: list[Action] = [LetGo(hand.number) for hand in self.hands.lapse(now)]
        return lapsed + self._heat(now, self.drive.elapse(now, reading))

    def decision(self, key: Key) -> Decision:
        """Write the decision on what lies under this key."""
        manner = self.hands.manner(key)
        return self._world.decision(key, self.drive.gain, self.drive.reading, manner)

    def look_again(self) -> list[Action]:
        """Have the regions under the hands looked at in the newest frame."""
        looks: list[Action] = []
        for hand in self.hands:
            if hand.is_touching:
                looks += self._look(hand)
        return looks

    def renew(self) -> list[Action]:
        """Say and feel what changed for the hands after the scene or a setting changed."""
        actions: list[Action] = []
        for hand in self.hands:
            if hand.is_touching:
                actions += self.refeel(hand.key)
                actions += self._news(hand, cached=False)
        return actions

    def refeel(self, key: Key) -> list[Action]:
        """Give a rubbing hand its texture anew; an impact that rings is left alone."""
        return [
            action
            for hand in self.hands
            if hand.is_felt and hand.rubs and hand.key == key
            for action in self._feel(hand, onset=False)
        ]

    def _move(self, hand: Hand, touch: Touch, now: float) -> list[Action]:
        was_felt, was_touching = hand.is_felt, hand.is_touching
        onset = hand.follow(touch, now)
        is_late = onset and self._frames.is_late(touch, now)
        self.late_contacts += is_late
        self.drive.touched(now)
        begins = hand.is_touching and not was_touching
        if begins and isinstance(hand.key, tuple):
            self._world.objects.forget(hand.key)
        was_decided = self._world.objects.is_decided(hand.key)
        actions: list[Action] = []
        if hand.is_felt and (hand.rubs or not is_late):
            actions += self._feel(hand, onset=onset and not is_late)
        elif was_felt and not hand.is_felt:
            actions.append(LetGo(hand.number))
        actions.append(Reply(Ok(id=touch.id)))
        actions += self._news(hand, cached=was_decided)
        return [*actions, *self._look(hand)] if begins else actions

    def _look(self, hand: Hand) -> list[Action]:
        return [*self._frames.look_at_region(hand, self._world.objects.generation(hand.key))]

    def _news(self, hand: Hand, *, cached: bool) -> list[Action]:
        """Tell the decision on what a hand touches if it is new or changed."""
        decision = self.decision(hand.key)
        if not self._world.is_news(hand.key, decision):
            return []
        return [Reply(msgspec.structs.replace(decision, cached=cached))]

    def _feel(self, hand: Hand, *, onset: bool) -> list[Action]:
        if self._hold.holds("speaker", hand.name) or hand.lease_until is None:
            return []
        self._onsets += onset
        command = Command(
            hand=hand.number,
            material=self._world.material(hand.key),
            interaction=hand.manner,
            onset=onset,
            stroke=hand.stroke,
            seed=self._onsets,
            expires_at=hand.lease_until,
        )
        return [Feel(command)]

    def _heat(self, now: float, elapsed: float) -> list[Action]:
        hand = self.hands.on_plate
        is_held = self._hold.holds("peltier", hand.name if hand else None)
        if is_held or self.drive.is_idle(now):
            return self.drive.rest(now)
        contact = self._world.contact(hand.key) if hand else None
        return self.drive.follow(hand, contact, now, elapsed)
