"""Describes every fault of an output: its number and name, its symptom, and the remedy.

Symptoms and remedies are read from faults.toml. The numbered faults are the firmware's: they latch
there until they are cleared by name, and a test compares them with the firmware's header. The
others are found by the host; they have no number and go when their cause goes.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).with_name("faults.toml")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault; the number is None when the host finds it and not the firmware."""

    number: int | None
    name: str
    symptom: str
    remedy: str

    @property
    def text(self) -> str:
        """The symptom, the name and the remedy in one line."""
        label = self.name if self.number is None else f"{self.name}, number {self.number}"
        return f"{self.symptom} ({label}): {self.remedy}"


_WORDS = tomllib.loads(TABLE.read_text(encoding="utf-8"))
_FIRMWARE = enumerate(_WORDS["firmware"].items(), start=1)
FIRMWARE = {number: Fault(number, name, *words) for number, (name, words) in _FIRMWARE}
_HOST = {name: Fault(None, name, *words) for name, words in _WORDS["host"].items()}
UNPLUGGED = _HOST["plate_unplugged"]
RENAMED = _HOST["plate_renamed"]
SILENT = _HOST["plate_silent"]
GARBLED = _HOST["plate_garbled"]
VERSION = _HOST["plate_version"]
NOT_FOLLOWED = _HOST["plate_not_following"]
CLOCK_WRONG = _HOST["plate_clock_wrong"]
SPEAKER_GONE = _HOST["speaker_gone"]
SPEAKER_LOW = _HOST["speaker_low"]
SPEAKER_UNREACHED = _HOST["speaker_unreached"]
GLOVE_GONE = _HOST["glove_gone"]
INTIFACE_GONE = _HOST["intiface_gone"]
INTIFACE_EMPTY = _HOST["intiface_empty"]
_BY_NAME = {fault.name: fault for fault in (*FIRMWARE.values(), *_HOST.values())}


def names(bits: int) -> tuple[str, ...]:
    """Return the names in a telemetry bit field, where bit n is fault number n.

    The fault of a newer firmware is named `fault_n`.
    """
    numbers = (number for number in range(32) if bits >> number & 1)
    return tuple(
        FIRMWARE[number].name if number in FIRMWARE else f"fault_{number}" for number in numbers
    )


def describe(name: str) -> str:
    """Return the description of a fault; the name itself if it is of a newer firmware."""
    return _BY_NAME[name].text if name in _BY_NAME else name


def number_of(name_or_number: str) -> int:
    """Return the number of a firmware fault, given its name or number. Raises ValueError."""
    for number, fault in FIRMWARE.items():
        if name_or_number.lower() in (fault.name, str(number)):
            return number
    raise ValueError(f"no fault {name_or_number!r}; there are {_listed(FIRMWARE.values())}")


def _listed(faults: Iterable[Fault]) -> str:
    return ", ".join(f"{fault.number} {fault.name}" for fault in faults)
