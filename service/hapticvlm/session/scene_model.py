"""What one scene is believed to be: its objects, its surroundings, and the decision on each."""

from __future__ import annotations

from collections.abc import Mapping

from hapticvlm.materials import Material
from hapticvlm.messages import Decision, MessageError, Scene
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.rendering.thermal import ThermalContact
from hapticvlm.session import decisions
from hapticvlm.session.actions import AskMaterial, LookAt
from hapticvlm.session.scene_objects import Key, SceneObjects
from hapticvlm.session.surroundings import Surroundings


class World:
    """Objects and surroundings of one scene; can_ask = a VLM answers questions on both."""

    def __init__(
        self, table: Mapping[str, Material], *, can_ask: bool, contact_resistance: float | None
    ) -> None:
        self.objects = SceneObjects(table)
        self.surroundings = Surroundings(can_ask=can_ask)
        self._table = table
        self._can_ask = can_ask
        self._contact_resistance = contact_resistance

    @property
    def materials(self) -> tuple[str, ...]:
        """What the objects may be made of."""
        return tuple(self._table)

    def declare(self, scene: Scene) -> None:
        """Take in what the scene states. Raises MessageError and changes nothing if wrong."""
        try:
            self.objects.declare(scene)
        except MessageError as error:
            error.id = scene.id
            raise
        if scene.ambient_c is not None:
            self.surroundings.scene_c = scene.ambient_c

    def material(self, key: Key) -> str | None:
        """Return what this object is made of, or None for unknown."""
        return decisions.known(self.objects.verdict(key).material)

    def contact(self, key: Key) -> ThermalContact | None:
        """Return the thermal contact of skin and this object, or None for unknown."""
        verdict, facts = self.objects.verdict(key), self.objects.facts(key)
        warmth = decisions.surface_of(_name(key), verdict, facts, self.surroundings.ambient)
        return decisions.contact(
            verdict, facts, warmth.value_c, self._table, self._contact_resistance
        )

    def decision(
        self, key: Key, gain: float, reading: PlateReading, manner: str | None
    ) -> Decision:
        """Write the decision on this object at this thermal gain, touched in this manner."""
        around = decisions.Circumstances(self.surroundings.ambient, gain, reading, self._table)
        verdict, facts = self.objects.verdict(key), self.objects.facts(key)
        return decisions.describe(_name(key), verdict, facts, around, manner)

    def is_news(self, key: Key, decision: Decision) -> bool:
        """Tell whether this decision differs from the last one announced; remember it."""
        return self.objects.is_news(key, decisions.gist(decision))

    def question(self, look: LookAt, now: float) -> list[AskMaterial]:
        """Have a VLM asked what a named object is made of that the encoder leaves unknown."""
        if not self._can_ask or not isinstance(look.key, str):
            return []
        if not self.objects.wants_telling(look.key, now):
            return []
        return [AskMaterial(look.frame, look.key, look.generation)]


def _name(key: Key) -> str | None:
    return key if isinstance(key, str) else None
