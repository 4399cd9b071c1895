"""What a verdict is rendered as: its material where that is sure enough, else an expectation. Pure.

How sure is sure enough depends on what a mistake costs: see rendering/expectation.py. Nothing
believed, or something that is probably none of the materials, is rendered as nothing: neutral.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hapticvlm.evidence.ladder import Verdict
from hapticvlm.materials import UNKNOWN, Material, Thermal
from hapticvlm.messages import Basis
from hapticvlm.rendering import expectation
from hapticvlm.rendering.heat import contact as thermal

LEAST_KNOWN = 0.5  # belief in all materials together below which a thing is none of them


Vibrating = tuple[str | None, float]


@dataclass(frozen=True, slots=True)
class Rendition:
    """What a verdict can be rendered as: `named` alone, or between the materials believed in.

    `bulk` is what is expected; None where nothing is believed, or probably none of the materials.
    `impact` and `texture` are the material that vibrates, if any, and its gain.
    """

    named: str | None
    confidence: float
    bulk: Thermal | None
    impact: Vibrating
    texture: Vibrating

    def thermal(
        self, surface_c: float, table: Mapping[str, Material]
    ) -> tuple[Thermal | None, Basis]:
        """Return the bulk rendered at this surface temperature, and what it is made from."""
        if self.named is None:
            return self.bulk, "neutral" if self.bulk is None else "expectation"
        named = table[self.named].thermal
        if self.bulk is None:
            return named, "material"
        jump_c = _contact_c(named, surface_c) - _contact_c(self.bulk, surface_c)
        if self.confidence > expectation.needed_belief(None, jump_c):
            return named, "material"
        return self.bulk, "expectation"


def choose_rendition(verdict: Verdict, table: Mapping[str, Material]) -> Rendition:
    """Work out what a verdict can be rendered as; what the scene states is never graded."""
    named = None if verdict.material == UNKNOWN else verdict.material
    believed = verdict.beliefs.items()
    beliefs = {name: belief for name, belief in believed if belief > 0.0 and name in table}
    is_stated = named is not None and verdict.source == "scene"
    if is_stated or sum(beliefs.values()) < LEAST_KNOWN:
        return Rendition(named, verdict.confidence, None, (named, 1.0), (named, 1.0))
    bulk = expectation.expected_thermal(beliefs, table)
    graded = (expectation.nearest_vibration(beliefs, table), expectation.GRADED_GAIN)

    def vibrating(interaction: str) -> Vibrating:
        is_sure = verdict.confidence > expectation.needed_belief(interaction, 0.0)
        return (named, 1.0) if named is not None and is_sure else graded

    impact = vibrating("strike")
    texture = vibrating("slide")
    return Rendition(named, verdict.confidence, bulk, impact, texture)


def _contact_c(bulk: Thermal, surface_c: float) -> float:
    return thermal.contact_temperature_c(thermal.thermal_contact(bulk, surface_c))
