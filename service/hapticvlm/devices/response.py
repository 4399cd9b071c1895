"""The response file of a speaker: written by `hapticvlm calibrate speaker`, read by `serve`."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from hapticvlm import documents
from hapticvlm.rendering.equaliser import (
    HIGH_HZ,
    LOW_HZ,
    MOST_DB,
    REFERENCE_HZ,
    Correction,
    correction,
)

MAX_POINTS = 1000
MOST_RESPONSE_DB = 120.0
FIELDS = ("simulated", "frequency_hz", "response_db")


@dataclass(frozen=True, slots=True)
class SpeakerResponse:
    """Acceleration per drive at rising frequencies, dB re that at REFERENCE_HZ."""

    frequency_hz: tuple[float, ...]
    response_db: tuple[float, ...]
    simulated: bool = False

    def correction(self) -> Correction:
        """Return what the speaker needs."""
        return correction(self.frequency_hz, self.response_db)


def write_response(path: Path, response: SpeakerResponse) -> None:
    """Write the file. Raises OSError."""
    lines = (
        "# Acceleration of a speaker per drive, by `hapticvlm calibrate speaker`; dB re",
        f"# {REFERENCE_HZ:g} Hz. `serve --speaker-response` corrects {LOW_HZ:g}-{HIGH_HZ:g} Hz by",
        f"# at most {MOST_DB:g} dB either way.",
        f"simulated = {str(response.simulated).lower()}",
        f"frequency_hz = {[round(hz, 2) for hz in response.frequency_hz]}",
        f"response_db = {[round(db, 2) for db in response.response_db]}",
    )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_response(path: Path) -> SpeakerResponse:
    """Read the file. Raises OSError, ValueError naming the fault."""
    try:
        given = documents.parse_toml(documents.read_text(path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file: {error}") from None
    for field in given:
        if field not in FIELDS:
            raise ValueError(f"{path}: {field}: no such field; known: {', '.join(FIELDS)}")
    hertz = _numbers(path, given, "frequency_hz", (0.1, 100_000.0))
    levels_db = _numbers(path, given, "response_db", (-MOST_RESPONSE_DB, MOST_RESPONSE_DB))
    if len(hertz) != len(levels_db):
        raise ValueError(f"{path}: {len(hertz)} frequencies but {len(levels_db)} levels")
    if list(hertz) != sorted(set(hertz)):
        raise ValueError(f"{path}: frequency_hz does not rise; sort it")
    if not hertz[0] <= REFERENCE_HZ <= hertz[-1]:
        raise ValueError(f"{path}: frequency_hz must reach across {REFERENCE_HZ:g} Hz")
    return SpeakerResponse(hertz, levels_db, bool(given.get("simulated", False)))


def _numbers(
    path: Path, given: dict[str, object], field: str, limits: tuple[float, float]
) -> tuple[float, ...]:
    values = given.get(field)
    if not isinstance(values, list) or not 2 <= len(values) <= MAX_POINTS:
        raise ValueError(f"{path}: {field}: needs a list of 2 to {MAX_POINTS} numbers")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{path}: {field}: {str(value)[:40]!r} is not a number")
        if not math.isfinite(value) or not limits[0] <= value <= limits[1]:
            raise ValueError(f"{path}: {field}: {value} is not in {limits[0]:g}..{limits[1]:g}")
    return tuple(float(value) for value in values)
