"""The settings of a session: one frozen value, made at the handshake and written into its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hapticvlm.materials import MATERIALS, Material
from hapticvlm.messages import SceneObject
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.rendering.heat.limits import AT_REST, PlateReading
from hapticvlm.session.decisions import Feel


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """The role of a session, the materials its objects may have, and the state of the outputs.

    `saved_materials` are materials by object id that a person set in an earlier run (overrides.py).
    `can_ask`: a vision-language model answers questions. Resistances are in m2 K/W;
    `contact_resistance` None takes each material's own. `reading` and `thermal_gain` are those of
    the plate as the session finds it. `feel` says what an uncertain material is rendered as
    (decisions.py).
    """

    owner: bool
    observer: bool = False
    reading: PlateReading = AT_REST
    table: Mapping[str, Material] = field(default_factory=lambda: MATERIALS)
    saved_materials: Mapping[str, SceneObject] = field(default_factory=dict)
    can_ask: bool = False
    contact_resistance: float | None = None
    plate_resistance: float = PLATE_RESISTANCE
    thermal_gain: float = 1.0
    feel: Feel = "full"
