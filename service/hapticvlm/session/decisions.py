"""From a verdict, the scene's facts and the ambient to the `decision` on the wire. Pure."""

from __future__ import annotations

from hapticvlm import materials
from hapticvlm.messages import Decision, EvidenceItem, SceneObject
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.recognition.ambient import Ambient
from hapticvlm.recognition.ladder import Evidence, Verdict
from hapticvlm.rendering import thermal
from hapticvlm.rendering.thermal import ThermalContact


def known(material: str) -> str | None:
    """Return the material's name, or None for unknown: neutral plate, no texture."""
    return None if material == materials.UNKNOWN else material


def surface_c(facts: SceneObject | None, ambient: Ambient) -> float:
    """Return the object's surface temperature: what the scene states, else the ambient."""
    stated = facts.temperature_c if facts else None
    return ambient.value_c if stated is None else stated


def contact(verdict: Verdict, facts: SceneObject | None, ambient: Ambient) -> ThermalContact | None:
    """Return the thermal contact of skin and object, or None when the material is unknown."""
    name = known(verdict.material)
    if name is None:
        return None
    return thermal.thermal_contact(
        materials.MATERIALS[name].thermal,
        surface_c(facts, ambient),
        thickness_m=facts.thickness_m if facts else None,
    )


def describe(
    key: str | None,
    verdict: Verdict,
    facts: SceneObject | None,
    ambient: Ambient,
    thermal_gain: float,
    cached: bool,
) -> Decision:
    """Write the decision on one object as an event (id 0)."""
    touched = contact(verdict, facts, ambient)
    contact_c = None if touched is None else thermal.contact_temperature_c(touched)
    deviation = 0.0 if contact_c is None else thermal_gain * (contact_c - NEUTRAL_C)
    limited = thermal.within_range(NEUTRAL_C + deviation)
    return Decision(
        id=0,
        object_id=key,
        material=verdict.material,
        confidence=verdict.confidence,
        runner_up=verdict.runner_up,
        source=verdict.source,
        cached=cached,
        evidence=[_item(evidence) for evidence in verdict.evidence if evidence.material],
        ambient_c=ambient.value_c,
        ambient_low_c=ambient.low_c,
        ambient_high_c=ambient.high_c,
        ambient_source=ambient.source,
        surface_c=surface_c(facts, ambient),
        contact_c=contact_c,
        setpoint_c=limited.setpoint_c,
        unlimited_c=limited.unlimited_c,
        limited_by=limited.limited_by,
        thermal_cue=touched is not None and thermal.carries_cue(touched),
    )


def _item(evidence: Evidence) -> EvidenceItem:
    return EvidenceItem(
        rung=evidence.rung, material=evidence.material or "", confidence=evidence.confidence
    )
