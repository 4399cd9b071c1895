"""From a verdict, the scene's facts and the ambient to the `decision` on the wire. Pure.

A verdict is rendered as one material, in full: the one that it names, else the believed one of
least expected felt error (rendering/felt_error.py). The setting `graded` is for studies: a material
is then rendered only where it is sure enough, and else an expectation over the materials believed
in (rendering/expectation.py). Where nothing is believed, the object is probably none of the
materials, or any material would be a guess, nothing is rendered: the plate stays neutral and
nothing vibrates. People and animals are never felt as matter.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Literal

import msgspec

from hapticvlm import materials
from hapticvlm.evidence import surface
from hapticvlm.evidence.ambient import Ambient
from hapticvlm.evidence.ladder import Evidence, Verdict
from hapticvlm.evidence.sub_materials import MaterialDetail
from hapticvlm.evidence.surface import Surface, SurfaceFacts
from hapticvlm.materials import Material, Thermal
from hapticvlm.messages import Basis, Decision, EvidenceItem, NeutralCause, SceneObject
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering import expectation, felt_error
from hapticvlm.rendering.heat import contact as thermal
from hapticvlm.rendering.heat import limits as plate_limits
from hapticvlm.rendering.heat.contact import ThermalContact
from hapticvlm.rendering.heat.limits import PlateLimits
from hapticvlm.rendering.vibration.vibration import IMPACTS

# Belief in all materials together below which an object is probably made of something else.
LEAST_KNOWN = 0.5
GUESS = 0.2  # belief in the best material below which anything that is felt would be a guess

Feel = Literal["full", "graded"]
_OF_ONE_MATERIAL: tuple[Basis, ...] = ("material", "least_error")
Vibrating = tuple[str | None, float]


@dataclass(frozen=True, slots=True)
class Rendition:
    """The rendition of a verdict: one material, or a mean of the materials believed in.

    `felt` is the material that is rendered, if any. `impact` and `texture` are the material that
    vibrates, if any, and its gain. `mean` is what is expected where feel is graded, else None; it
    replaces the heat of `felt` unless `confidence` suffices.
    """

    felt: str | None
    confidence: float
    impact: Vibrating
    texture: Vibrating
    is_named: bool = True
    mean: Thermal | None = None

    def thermal(
        self, surface_c: float, table: Mapping[str, Material]
    ) -> tuple[Thermal | None, Basis]:
        """Return the bulk rendered at this surface temperature, and what it is made from."""
        if self.felt is None:
            return self.mean, "neutral" if self.mean is None else "expectation"
        bulk = table[self.felt].thermal
        if self.mean is None:
            return bulk, "material" if self.is_named else "least_error"
        jump_c = _contact_c(bulk, surface_c) - _contact_c(self.mean, surface_c)
        if self.confidence > expectation.needed_belief(None, jump_c):
            return bulk, "material"
        return self.mean, "expectation"


def choose_rendition(
    verdict: Verdict,
    table: Mapping[str, Material],
    feel: Feel = "full",
    before: Rendition | None = None,
) -> Rendition:
    """Work out what a verdict is rendered as; what the scene states is rendered as it is.

    `before` is what the same object was rendered as: it is kept until another material is better by
    more than flickering beliefs make it.
    """
    named = known(verdict.material)
    believed = verdict.beliefs.items()
    beliefs = {name: belief for name, belief in believed if belief > 0.0 and name in table}
    is_stated = named is not None and verdict.source == "scene"
    if is_stated or sum(beliefs.values()) < LEAST_KNOWN or max(beliefs.values()) < GUESS:
        return Rendition(named, verdict.confidence, (named, 1.0), (named, 1.0))
    if feel == "graded":
        return _graded(named, verdict.confidence, beliefs, table)
    felt = named
    if felt is None:
        felt = felt_error.least_felt_error(beliefs, table, None if before is None else before.felt)
    is_doubtful = verdict.beliefs.get(felt, 0.0) < felt_error.DOUBTFUL
    impact_gain = felt_error.DOUBTFUL_IMPACT if is_doubtful else 1.0
    return Rendition(
        felt, verdict.confidence, (felt, impact_gain), (felt, 1.0), is_named=named is not None
    )


def _graded(
    named: str | None,
    confidence: float,
    beliefs: Mapping[str, float],
    table: Mapping[str, Material],
) -> Rendition:
    """Return the expectation over these beliefs, and the named material where it is sure enough."""
    nearest = (expectation.nearest_vibration(beliefs, table), expectation.GRADED_GAIN)

    def vibrating(interaction: str) -> Vibrating:
        is_sure = confidence > expectation.needed_belief(interaction, 0.0)
        return (named, 1.0) if named is not None and is_sure else nearest

    mean = expectation.expected_thermal(beliefs, table)
    return Rendition(named, confidence, vibrating("strike"), vibrating("slide"), mean=mean)


def _contact_c(bulk: Thermal, surface_c: float) -> float:
    return thermal.contact_temperature_c(thermal.thermal_contact(bulk, surface_c))


def known(material: str) -> str | None:
    """Return the name of the material, or None for unknown."""
    return None if material == materials.UNKNOWN else material


def surface_of(
    object_id: str | None, felt: str | None, facts: SceneObject | None, ambient: Ambient
) -> Surface:
    """Return the surface's temperature: stated, by its name, by the sun, else the ambient.

    `felt` is the material that is rendered, if any.
    """
    return surface.surface(
        SurfaceFacts(
            name=facts.name if facts else None,
            object_id=object_id,
            material=felt,
            stated_c=facts.temperature_c if facts else None,
            sunlit=facts.sunlit if facts else None,
        ),
        ambient,
    )


def thickness_m(
    felt: str | None, facts: SceneObject | None, detail: MaterialDetail
) -> float | None:
    """Return how thick the object is, m: as the scene states, else as its name; None is thick."""
    stated = facts.thickness_m if facts else None
    return detail.thickness_m.get(felt or materials.UNKNOWN) if stated is None else stated


def contact(
    bulk: Thermal | None,
    thickness_m: float | None,
    surface_c: float,
    contact_resistance: float | None = None,
) -> ThermalContact | None:
    """Return the thermal contact of skin and object, or None when there is nothing to feel.

    A contact resistance in m2 K/W, as calibrated for a palm, replaces that of the material.
    """
    if bulk is None:
        return None
    return thermal.thermal_contact(
        bulk,
        surface_c,
        thickness_m=thickness_m,
        contact_resistance=contact_resistance,
    )


@dataclass(frozen=True, slots=True)
class DecisionInputs:
    """The inputs of a decision, beside the object's name and the material table."""

    verdict: Verdict
    rendition: Rendition
    detail: MaterialDetail
    facts: SceneObject | None
    ambient: Ambient
    thermal_gain: float
    limits: PlateLimits


def decide(
    object_id: str | None, inputs: DecisionInputs, table: Mapping[str, Material]
) -> Decision:
    """Return the decision on one object as an event (id 0), not yet touched: it has no pattern.

    The table has the materials as this object has them, sub-materials in their place.
    """
    verdict = inputs.verdict
    ambient = inputs.ambient
    felt = inputs.rendition.felt
    surface = surface_of(object_id, felt, inputs.facts, ambient)
    bulk, basis = inputs.rendition.thermal(surface.value_c, table)
    thick_m = thickness_m(felt, inputs.facts, inputs.detail)
    touched = contact(bulk, thick_m, surface.value_c)
    contact_c = None if touched is None else thermal.contact_temperature_c(touched)
    deviation = 0.0 if contact_c is None else inputs.thermal_gain * (contact_c - NEUTRAL_C)
    strength = 1.0 if bulk is None else thermal.strength(bulk)
    limited = plate_limits.settle_material(NEUTRAL_C + deviation, strength, inputs.limits)
    return Decision(
        id=0,
        object_id=object_id,
        material=verdict.material,
        confidence=verdict.confidence,
        runner_up=verdict.runner_up,
        source=verdict.source,
        cached=False,
        evidence=[_item(evidence) for evidence in verdict.evidence if evidence.material],
        ambient_c=ambient.value_c,
        ambient_low_c=ambient.low_c,
        ambient_high_c=ambient.high_c,
        ambient_source=ambient.source,
        surface_c=surface.value_c,
        surface_low_c=surface.low_c,
        surface_high_c=surface.high_c,
        surface_source=surface.source,
        surface_why=surface.why,
        contact_c=contact_c,
        setpoint_c=limited.setpoint_c,
        unlimited_c=limited.unlimited_c,
        limited_by=limited.limited_by,
        thermal_cue=touched is not None and thermal.carries_cue(touched),
        basis=basis,
        neutral_because=_neutral_because(verdict) if basis == "neutral" else None,
        felt=felt if basis in _OF_ONE_MATERIAL else None,
        feels=table[felt].feels if felt and basis in _OF_ONE_MATERIAL else [],
        sub_material=inputs.detail.sub_material(felt or verdict.material),
        thickness_m=None if touched is None else thick_m,
    )


def _neutral_because(verdict: Verdict) -> NeutralCause:
    alive = verdict.beliefs.get(materials.LIVING, 0.0)
    return "living" if alive > verdict.confidence else "guess"


def touched_as(decision: Decision, interaction: str | None, rendition: Rendition) -> Decision:
    """Return the decision with the pattern of this interaction; nothing believed in has none."""
    if interaction is None:
        return decision
    material, gain = rendition.impact if interaction in IMPACTS else rendition.texture
    if material is None:
        return decision
    pattern = f"{material} {interaction}"
    if rendition.mean is None or gain == 1.0:
        return msgspec.structs.replace(decision, pattern=pattern)
    return msgspec.structs.replace(
        decision, pattern=pattern, basis="expectation", felt=None, feels=[]
    )


def change_key(decision: Decision) -> Hashable:
    """Return what makes a decision a changed one: not the last digit, nor a current limit."""
    limited_by = None if decision.limited_by == "current" else decision.limited_by
    return (
        decision.material,
        decision.source,
        decision.thermal_cue,
        decision.basis,
        decision.felt,
        limited_by,
        round(decision.confidence, 1),
        round(decision.surface_c, 1),
        round(decision.setpoint_c),
    )


def _item(evidence: Evidence) -> EvidenceItem:
    return EvidenceItem(
        rung=evidence.rung, material=evidence.material or "", confidence=evidence.confidence
    )
