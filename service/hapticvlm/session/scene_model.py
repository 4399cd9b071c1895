"""The model of one scene: its objects, its surroundings, and the decision on each object."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import TypeGuard

import msgspec

from hapticvlm.materials import Vibration
from hapticvlm.messages import Decision, Error, Frame, MessageError, Scene, SceneObject, Touch
from hapticvlm.rendering.heat.contact import ThermalContact
from hapticvlm.rendering.heat.limits import PlateLimits
from hapticvlm.rendering.vibration.hum import Hum
from hapticvlm.session import decisions
from hapticvlm.session.actions import Action, AskMaterial, Reply
from hapticvlm.session.decisions import DecisionInputs, Rendition, choose_rendition
from hapticvlm.session.overrides import MaterialOverrides
from hapticvlm.session.scene_objects import Cached, ObjectState, SceneObjects
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.surroundings import Surroundings
from hapticvlm.session.targets import (
    ObjectTarget,
    RecognitionRequest,
    ThingTarget,
    of_object,
    whole,
)


class SceneModel:
    """Objects and surroundings of one scene."""

    def __init__(self, settings: SessionSettings) -> None:
        self.objects = SceneObjects(settings.table, MaterialOverrides(settings.saved_materials))
        self.surroundings = Surroundings(can_ask=settings.can_ask)
        self._table = settings.table
        self._materials = tuple(settings.table)
        self._can_ask = settings.can_ask
        self._contact_resistance = settings.contact_resistance
        self._feel = settings.feel

    @property
    def materials(self) -> tuple[str, ...]:
        """The materials that the objects may have."""
        return self._materials

    def declare(self, scene: Scene) -> None:
        """Receive the scene's objects. Raises MessageError and changes nothing if wrong."""
        try:
            self.objects.declare(scene)
        except MessageError as error:
            error.id = scene.id
            raise
        if scene.ambient_c is not None:
            self.surroundings.scene_c = scene.ambient_c

    def announced(self, keys: Iterable[ThingTarget]) -> dict[ThingTarget, Hashable]:
        """Return what was last announced of each of these objects, if anything was."""
        known = {target: self.objects.known.get(target) for target in keys}
        return {
            target: state.announced.value
            for target, state in known.items()
            if state and state.announced
        }

    def on_stated_surface(self, touch: Touch) -> tuple[Touch, list[Action]]:
        """Return the touch on a surface that its object has, and what to tell the client once.

        A mesh may have changed under a hand, and a client may count wrongly. Refused, such a touch
        would not be felt at all, so it is felt as one of the largest surface.
        """
        target = of_object(touch.object_id, touch.surface)
        if self.objects.has_surface(target):
            return touch, []
        state = self._state(whole(target))
        felt = msgspec.structs.replace(touch, surface=0)
        if state.is_told or state.facts is None:
            return felt, []
        state.is_told = True
        count = len(state.facts.surfaces or ())
        text = (
            f"$.surface: `{touch.object_id}` states {count} surfaces and none with the index "
            f"{touch.surface}, so its largest one is felt; state it again with all its surfaces"
        )
        return felt, [Reply(Error(id=0, code="message", text=text, path="$.surface"))]

    def has_verdict(self, target: ThingTarget) -> bool:
        """Whether a verdict on this object is at hand."""
        state = self.objects.known.get(target)
        return state is not None and state.verdict is not None

    def rendition(self, target: ThingTarget) -> Rendition:
        """Return what this object is rendered as, worked out once for each verdict."""
        state = self._state(target)
        verdict = state.verdict
        assert verdict is not None
        kept = state.rendition
        if kept is None or kept.inputs is not verdict:
            before = None if kept is None else kept.value
            rendition = choose_rendition(verdict, state.table, self._feel, before)
            kept = state.rendition = Cached(rendition, verdict)
        return kept.value

    def swung_m(self, target: ThingTarget) -> float | None:
        """Return the thickness the scene states for this object, m; None where it states none."""
        facts = self._state(target).facts
        return None if facts is None else facts.thickness_m

    def hum(self, target: ThingTarget) -> Hum | None:
        """Return what a hand on this feels of things that vibrate; None where nothing does."""
        if not isinstance(target, ObjectTarget):
            return None
        hums = self.objects.hums
        if target.object_id in hums.kept:  # a renewal goes no farther
            return hums.kept[target.object_id]
        return hums.felt(target.object_id, self._facts_of, self._vibration_of)

    def _facts_of(self, object_id: str) -> SceneObject | None:
        state = self.objects.known.get(ObjectTarget(object_id))
        return None if state is None else state.facts

    def _vibration_of(self, object_id: str) -> Vibration | None:
        state = self.objects.known.get(ObjectTarget(object_id))
        verdict = None if state is None else state.verdict
        material = None if verdict is None else self._table.get(verdict.material)
        return None if material is None else material.vibration

    def contact(self, target: ThingTarget) -> ThermalContact | None:
        """Return the thermal contact of skin and this object; None where nothing is felt."""
        state = self._state(target)
        ambient = self.surroundings.ambient
        rendition = self.rendition(target)
        inputs = (rendition, state.facts, ambient)
        if state.contact is None or state.contact.inputs != inputs:
            felt = rendition.felt
            surface = decisions.surface_of(_name(target), felt, state.facts, ambient)
            bulk, _ = rendition.thermal(surface.value_c, state.table)
            thickness_m = decisions.thickness_m(felt, state.facts, state.detail)
            contact = decisions.contact(
                bulk, thickness_m, surface.value_c, self._contact_resistance
            )
            state.contact = Cached(contact, inputs)
        return state.contact.value

    def decision(self, target: ThingTarget, gain: float, limits: PlateLimits) -> Decision:
        """Return the decision on this object, made again only if its inputs have changed."""
        state = self._state(target)
        ambient = self.surroundings.ambient
        verdict = state.verdict
        assert verdict is not None
        rendition = self.rendition(target)
        inputs = (verdict, rendition, state.facts, ambient, gain, limits)
        if state.decision is None or state.decision.inputs != inputs:
            given = DecisionInputs(
                verdict, rendition, state.detail, state.facts, ambient, gain, limits
            )
            decision = decisions.decide(_name(target), given, state.table)
            if _is_one_of_several(target, state.facts):
                decision = msgspec.structs.replace(decision, surface=target.surface)
            state.decision = Cached(decision, inputs)
        return state.decision.value

    def changed_decision(
        self, target: ThingTarget, gain: float, limits: PlateLimits
    ) -> Decision | None:
        """Return the decision if it differs from the one last announced, else None.

        Compares the inputs first: a touch that only renews its lease ends here.
        """
        state = self._state(target)
        ambient = self.surroundings.ambient
        inputs = (state.verdict, self.rendition(target), state.facts, ambient, gain, limits)
        before = state.announced
        if before is not None and before.inputs == inputs:
            return None
        decision = self.decision(target, gain, limits)
        state.announced = Cached(decisions.change_key(decision), inputs)
        return decision if before is None or state.announced.value != before.value else None

    def reference_request(self, frame: Frame, target: ObjectTarget) -> list[RecognitionRequest]:
        """Request a reference for the scene from a picture of an object whose material is sure."""
        objects = self.objects
        material = objects.reference_material(target, always=frame.purpose == "enrol")
        if material is None:
            return []
        return [
            RecognitionRequest(
                target,
                frame,
                None,
                objects.generation(target),
                scene=objects.scene_number,
                reference_material=material,
            )
        ]

    def question(self, request: RecognitionRequest, now: float) -> list[AskMaterial]:
        """Ask a VLM what a named object is made of that the encoder leaves unknown."""
        asked = request.target
        if not self._can_ask or not isinstance(asked, ObjectTarget):
            return []
        if not self.objects.wants_question(asked, now):
            return []
        return [AskMaterial(request.picture, asked, request.generation)]

    def _state(self, target: ThingTarget) -> ObjectState:
        """Return what is known of an object: at once where there is a verdict on it."""
        state = self.objects.known.get(target)
        return self.objects.state(target) if state is None or state.verdict is None else state


def _name(target: ThingTarget) -> str | None:
    return target.object_id if isinstance(target, ObjectTarget) else None


def _is_one_of_several(target: ThingTarget, facts: SceneObject | None) -> TypeGuard[ObjectTarget]:
    return isinstance(target, ObjectTarget) and facts is not None and len(facts.surfaces or ()) > 1
