"""What can be wrong with an output: number, name, what was seen, what a person can do about it.

The numbered faults are the firmware's, latched there; a test compares them with its header. The
others are found by the host, have no number and go when their cause goes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault; no number means that the host found it."""

    number: int | None
    name: str
    seen: str
    cure: str

    @property
    def text(self) -> str:
        """The fault in words."""
        label = self.name if self.number is None else f"{self.name}, number {self.number}"
        return f"{self.seen} ({label}): {self.cure}"


_OPEN, _SHORT = "check its wire and plug", "check its wire for bare copper"
_FIRMWARE = (
    ("plate_a_open", "the first plate thermistor reads as open", _OPEN),
    ("plate_a_short", "the first plate thermistor reads as shorted", _SHORT),
    ("plate_b_open", "the second plate thermistor reads as open", _OPEN),
    ("plate_b_short", "the second plate thermistor reads as shorted", _SHORT),
    ("sink_open", "the sink thermistor reads as open", _OPEN),
    ("sink_short", "the sink thermistor reads as shorted", _SHORT),
    (
        "plate_disagrees",
        "the two plate thermistors differ too much",
        "one came loose, drifts, is of another type, or is swapped with the sink's",
    ),
    (
        "plate_frozen",
        "one plate thermistor moves and the other stands still",
        "replace the one that stands still",
    ),
    (
        "reading_jumps",
        "a reading changed faster than the plate can",
        "loose contact or interference: check plugs and screening",
    ),
    (
        "over_temperature",
        "the plate reached 43 degC",
        "take the hand off, let it cool, and find out why before clearing",
    ),
    (
        "under_temperature",
        "the plate fell to 13 degC",
        "take the hand off and let it warm up; a very cold room does it too",
    ),
    (
        "sink_hot",
        "the heat sink reached 44 degC",
        "take the hand off; check the fan and the heat path, or use a larger sink",
    ),
    (
        "runaway",
        "driven hard for 1 s, the plate did not follow",
        "its thermistor came off, the module is broken or its supply is missing",
    ),
    (
        "wired_backwards",
        "driven, the plate went the other way",
        "swap the two wires of the module",
    ),
    (
        "cooling_reversed",
        "more cooling current made the plate warmer",
        "the heat sink is too small or its fan is dead",
    ),
    (
        "dose_spent",
        "the session's thermal dose reached 2 CEM43",
        "rest the skin for 15 min; only then can it be cleared",
    ),
    (
        "watchdog",
        "the board's program hung and was reset",
        "clear it once; if it comes back, report it",
    ),
    (
        "brown_out",
        "the board's supply fell too low",
        "use a separate supply for the module, or a shorter or thicker USB cable",
    ),
    (
        "restarted_driving",
        "the board was reset while it was driving",
        "the program hung, the supply fell, or the port was opened again meanwhile",
    ),
    (
        "sink_implausible",
        "the sink reads colder than the plate's heat can leave it",
        "the sink thermistor came off or is swapped",
    ),
    (
        "cut_out_open",
        "the cut-out in series with the module is open",
        "take the hand off; press its button; if it opens again, find out why first",
    ),
)
UNPLUGGED = Fault(
    None,
    "plate_unplugged",
    "the plate's port is gone",
    "plug it in again; it then waits for a new touch",
)
SILENT = Fault(
    None,
    "plate_silent",
    "the plate's port is there but no telemetry came for a while",
    "check the cable and the board's supply",
)
VERSION = Fault(
    None,
    "plate_version",
    "the plate that came back speaks another version of the protocol",
    "write the firmware of this release: hapticvlm plate flash",
)
NOT_FOLLOWED = Fault(
    None,
    "plate_not_following",
    "the plate was sent setpoints for a second and follows none",
    "noise on its line, or a broken wire to the board: check cable, ground and screening",
)
SPEAKER_GONE = Fault(
    None,
    "speaker_gone",
    "the speaker's audio output is gone",
    "plug it in again, or choose another with --speaker; it then waits for a new touch",
)
FIRMWARE = {number: Fault(number, *words) for number, words in enumerate(_FIRMWARE, start=1)}
_HOST = (UNPLUGGED, SILENT, VERSION, NOT_FOLLOWED, SPEAKER_GONE)
_BY_NAME = {fault.name: fault for fault in (*FIRMWARE.values(), *_HOST)}


def names(bits: int) -> tuple[str, ...]:
    """Name the faults of a telemetry bit field, bit n standing for number n; unknown ones too."""
    numbers = (number for number in range(32) if bits >> number & 1)
    return tuple(
        FIRMWARE[number].name if number in FIRMWARE else f"fault_{number}" for number in numbers
    )


def describe(name: str) -> str:
    """Return a fault in words; a name of a newer firmware stays a name."""
    return _BY_NAME[name].text if name in _BY_NAME else name


def numbered(named: str) -> int:
    """Return the number of a firmware fault, given its name or number. Raises ValueError."""
    for number, fault in FIRMWARE.items():
        if named.lower() in (fault.name, str(number)):
            return number
    raise ValueError(f"no fault {named!r}; there are {_listed(FIRMWARE.values())}")


def _listed(found: Iterable[Fault]) -> str:
    return ", ".join(f"{fault.number} {fault.name}" for fault in found)
