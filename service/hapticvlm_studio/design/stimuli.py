"""Defines the patterns that a study presents, a vibration and a temperature each. Knows no device.

A file of patterns has one `[[pattern]]` table for each, with the fields of `Stimulus`. It states
the setpoint of the plate. The service takes objects instead of setpoints, so it is sent an object
of the temperature To that brings the skin to the setpoint by the end of the pattern,

    To = neutral + (setpoint - neutral) / share(lead + strokes)

with the share of the difference that the skin has taken on by then (physics.md 1.1). This way the
contact model, its lead and all limits of the service stay in force.

A hand presents the pattern: it approaches, rests on the object without rubbing until the plate has
brought heat or cold to the palm, lifts for a moment and strokes. This lift, and those between
strokes, are brief enough for the plate to treat everything as one contact, so repeated strokes are
as warm as a single one. Within a stroke the hand rubs, carves or swings to and fro
(rendering/vibration/vibration.py).
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError
from hapticvlm.materials import MATERIALS, UNKNOWN
from hapticvlm.messages import Interaction
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import LEAD_S, share, thermal_contact
from hapticvlm.rendering.heat.limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.rendering.vibration.vibration import Motion, motion_at

MAX_PATTERNS = 40
OBJECT_C = (-100.0, 400.0)  # degC, the protocol's limits of an object's temperature
_MAX_S = 10.0
LIFT_S = 0.06  # of the hand before a stroke
_STILL = Motion(0.0, 0.0)


class StudyError(HapticVLMError):
    """Raised when a study cannot be run or read; the message says what is wrong and where."""


@dataclass(frozen=True, slots=True)
class Stimulus:
    """One pattern: `repeats` strokes within `seconds`, while the plate goes to `setpoint_c`.

    `speed_mps` is the highest speed of a stroke. The palm rests on the object, still, for `lead_s`
    before the first stroke. `vibration` and `temperature` name the levels of the two factors, as in
    the data. Raises StudyError, which names the field.
    """

    name: str
    vibration: str
    temperature: str
    material: str
    interaction: str
    setpoint_c: float
    speed_mps: float = 0.3
    force_n: float = 1.5
    seconds: float = 2.4
    repeats: int = 1
    lead_s: float = LEAD_S

    def __post_init__(self) -> None:
        for fault in self._faults():
            raise StudyError(f"pattern {self.name!r}: {fault}")

    def _faults(self) -> Iterable[str]:
        if not self.name or not self.name.replace("-", "").replace("_", "").isalnum():
            yield "name: must consist of letters, digits, - and _"
        if self.material not in MATERIALS or self.material == UNKNOWN:
            yield f"material {self.material!r}: must be one of {', '.join(MATERIALS)}"
        if self.interaction not in get_args(Interaction):
            known = ", ".join(get_args(Interaction))
            yield f"interaction {self.interaction!r}: must be one of {known}"
        for field, (low, high) in _RANGES.items():
            if not low <= getattr(self, field) <= high:
                yield f"{field} {getattr(self, field):g}: must be {low:g} to {high:g}"
        if not OBJECT_C[0] <= self.object_c <= OBJECT_C[1]:
            yield (
                f"setpoint_c {self.setpoint_c:g}: {self.material} cannot carry it; choose another "
                "material or a milder setpoint"
            )

    @property
    def object_c(self) -> float:
        """Temperature of the object that brings skin to the setpoint by the end, degC."""
        contact = thermal_contact(MATERIALS[self.material].thermal, NEUTRAL_C)
        return NEUTRAL_C + (self.setpoint_c - NEUTRAL_C) / share(
            contact, self.lead_s + self.seconds
        )

    def described(self) -> dict[str, str]:
        """Return what a page shows of the pattern."""
        return {
            "name": self.name,
            "vibration": self.vibration,
            "temperature": self.temperature,
            "material": self.material,
            "interaction": self.interaction,
        }


_RANGES = {
    "setpoint_c": (SETPOINT_MIN_C, SETPOINT_MAX_C),
    "speed_mps": (0.0, 20.0),
    "force_n": (0.0, 200.0),
    "seconds": (0.1, _MAX_S),
    "repeats": (1, 20),
    "lead_s": (LEAD_S, _MAX_S),
}


def read(path: Path) -> tuple[Stimulus, ...]:
    """Read a file of patterns. Raises StudyError."""
    try:
        tables = documents.read_toml(path, dict[str, Any]).get("pattern")
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise StudyError(f"{path}: {documents.reason(error)}") from None
    if not isinstance(tables, list):
        raise StudyError(f"{path}: needs one [[pattern]] table per pattern")
    return revive(tables, str(path))


def checked(stimuli: Iterable[Stimulus]) -> tuple[Stimulus, ...]:
    """Check that the patterns differ in name and in factors, and return them. Raises StudyError."""
    patterns = tuple(stimuli)
    if not 2 <= len(patterns) <= MAX_PATTERNS:
        raise StudyError(f"{len(patterns)} patterns: a study needs 2 to {MAX_PATTERNS}")
    names = [stimulus.name for stimulus in patterns]
    cells = [(stimulus.vibration, stimulus.temperature) for stimulus in patterns]
    for values in (names, cells):
        if len(set(values)) < len(values):
            raise StudyError(
                "two patterns share a name, or share vibration and temperature; change one of them"
            )
    return patterns


def revive(tables: Iterable[dict[str, Any]], file: str) -> tuple[Stimulus, ...]:
    """Convert and check the pattern tables of a file of this name. Raises StudyError."""
    return checked(_stimulus(table, f"{file}, pattern {i}") for i, table in enumerate(tables, 1))


def _stimulus(table: dict[str, Any], where: str) -> Stimulus:
    kinds = {field.name: str(field.type) for field in fields(Stimulus)}
    for name, value in table.items():
        if name not in kinds:
            raise StudyError(f"{where}: no field `{name}`; fields are {', '.join(kinds)}")
        fits = isinstance(value, str) if kinds[name] == "str" else isinstance(value, int | float)
        if not fits or isinstance(value, bool):
            kind = "a text" if kinds[name] == "str" else "a number"
            raise StudyError(f"{where}: {name} is not {kind} ({json.dumps(value)})")
    for name in (field.name for field in fields(Stimulus) if field.default is MISSING):
        if name not in table:
            raise StudyError(f"{where}: `{name}` is missing")
    return Stimulus(**table)


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the hand's motion; the hand moves in contact only."""

    phase: Literal["approach", "slide", "contact"]
    seconds: float

    @property
    def is_still(self) -> bool:
        """Whether the hand does not stroke."""
        return self.phase != "contact"


def parts(stimulus: Stimulus) -> tuple[Part, ...]:
    """Return the parts of the hand's motion, in order; `lead_s` passes before the first contact."""
    rest_s = stimulus.lead_s - LEAD_S - LIFT_S
    lead: tuple[Part, ...] = (Part("approach", stimulus.lead_s),)
    if rest_s > 0.0:
        lead = (Part("approach", LEAD_S), Part("slide", rest_s), Part("approach", LIFT_S))
    each_s = stimulus.seconds / stimulus.repeats
    stroke = (Part("contact", each_s - LIFT_S), Part("approach", LIFT_S))
    return (*lead, *stroke * (stimulus.repeats - 1), Part("contact", each_s))


def motion(stimulus: Stimulus, part: Part, elapsed_s: float) -> Motion:
    """Return how the hand moves `elapsed_s` after this part began."""
    if part.is_still:
        return _STILL
    peak = Motion(stimulus.speed_mps, stimulus.force_n)
    return motion_at(stimulus.interaction, peak, elapsed_s)
