"""What can be wrong with an output: number, name, what was seen, what a person can do about it.

The words are those of faults.toml. The numbered faults are the firmware's, latched there; a test
compares them with its header. The others are found by the host, have no number and go when their
cause goes.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).with_name("faults.toml")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault; no number means that the host found it."""

    number: int | None
    name: str
    symptom: str
    remedy: str

    @property
    def text(self) -> str:
        """The fault in words."""
        label = self.name if self.number is None else f"{self.name}, number {self.number}"
        return f"{self.symptom} ({label}): {self.remedy}"


_WORDS = tomllib.loads(TABLE.read_text(encoding="utf-8"))
_FIRMWARE = enumerate(_WORDS["firmware"].items(), start=1)
FIRMWARE = {number: Fault(number, name, *words) for number, (name, words) in _FIRMWARE}
_HOST = {name: Fault(None, name, *words) for name, words in _WORDS["host"].items()}
UNPLUGGED = _HOST["plate_unplugged"]
SILENT = _HOST["plate_silent"]
VERSION = _HOST["plate_version"]
NOT_FOLLOWED = _HOST["plate_not_following"]
CLOCK_WRONG = _HOST["plate_clock_wrong"]
SPEAKER_GONE = _HOST["speaker_gone"]
_BY_NAME = {fault.name: fault for fault in (*FIRMWARE.values(), *_HOST.values())}


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
