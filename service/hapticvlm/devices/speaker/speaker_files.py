"""Reads the files that a user provides for a speaker: its response, and recordings of patterns.

`hapticvlm calibrate speaker` writes the response. Recordings are a folder of files named
MATERIAL-INTERACTION.wav, and each replaces the built-in pattern of that name.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hapticvlm import documents
from hapticvlm.devices.speaker.audio import read_wav
from hapticvlm.errors import why_no_folder
from hapticvlm.materials import Material
from hapticvlm.rendering.vibration.equaliser import (
    HIGH_HZ,
    LOW_HZ,
    MAX_DB,
    NOMINAL,
    REFERENCE_HZ,
    Correction,
    Playback,
    correction,
)
from hapticvlm.rendering.vibration.patterns import (
    LONGEST_S,
    Pattern,
    PatternError,
    pattern,
    replaced_key,
)

MAX_POINTS = 1000
MAX_FILES = 200
ENDINGS = (".wav", ".flac", ".aif", ".aiff", ".ogg", ".mp3", ".w64", ".caf")
MAX_RESPONSE_DB = 120.0
_TOLD_LEAD_S = 0.01
FULL_SCALES_DB = (5.0, 95.0)
FIELDS = ("simulated", "frequency_hz", "response_db", "full_scale_db")

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SpeakerResponse:
    """Acceleration of a speaker per drive, in dB relative to REFERENCE_HZ, at rising frequencies.

    `simulated` says that it was measured on a simulated speaker. `full_scale_db` is how far a
    full-scale sine of REFERENCE_HZ lies above the threshold of the hand; None if no hand was asked.
    """

    frequency_hz: tuple[float, ...]
    response_db: tuple[float, ...]
    simulated: bool = False
    full_scale_db: float | None = None

    def correction(self) -> Correction:
        """Return the correction that makes this speaker's response flat."""
        return correction(self.frequency_hz, self.response_db)

    def playback(self) -> Playback:
        """Return how waveforms are made for this speaker and hand."""
        if self.full_scale_db is None:
            return Playback(correction=self.correction())
        return Playback(correction=self.correction(), full_scale_db=self.full_scale_db)


def write_response(path: Path, response: SpeakerResponse) -> None:
    """Write a response file. Raises OSError."""
    lines = [
        "# Acceleration of a speaker per drive, by `hapticvlm calibrate speaker`, or how a hand",
        "# feels it compared with the expected thresholds, by its --by-hand; dB relative to",
        f"# {REFERENCE_HZ:g} Hz. `serve --speaker-response` corrects {LOW_HZ:g}-{HIGH_HZ:g} Hz by",
        f"# at most {MAX_DB:g} dB either way.",
        f"simulated = {str(response.simulated).lower()}",
        f"frequency_hz = {[round(hz, 2) for hz in response.frequency_hz]}",
        f"response_db = {[round(db, 2) for db in response.response_db]}",
    ]
    if response.full_scale_db is not None:
        lines += [
            f"# Full scale at {REFERENCE_HZ:g} Hz above the threshold of the hand: weak blows are",
            "# raised until they are felt.",
            f"full_scale_db = {response.full_scale_db:.1f}",
        ]
    documents.replace_file(path, "\n".join(lines) + "\n")


def read_response(path: Path) -> SpeakerResponse:
    """Read a response file. Raises OSError, ValueError naming the file, the field and the limit."""
    try:
        document = documents.read_toml(path, dict[str, Any])
    except ValueError as error:
        raise ValueError(f"{path}: {documents.reason(error)}") from None
    for field in document:
        if field not in FIELDS:
            raise ValueError(f"{path}: {field}: no such field; known: {', '.join(FIELDS)}")
    hertz = _numbers(path, document, "frequency_hz", (0.1, 100_000.0))
    levels_db = _numbers(path, document, "response_db", (-MAX_RESPONSE_DB, MAX_RESPONSE_DB))
    if len(hertz) != len(levels_db):
        raise ValueError(
            f"{path}: {len(hertz)} frequencies but {len(levels_db)} levels; give one for each"
        )
    if list(hertz) != sorted(set(hertz)):
        raise ValueError(f"{path}: frequency_hz must rise; sort it and remove duplicates")
    if not hertz[0] <= REFERENCE_HZ <= hertz[-1]:
        raise ValueError(f"{path}: frequency_hz must include {REFERENCE_HZ:g} Hz in its range")
    full_scale_db = None
    if "full_scale_db" in document:
        full_scale_db = _number(path, "full_scale_db", document["full_scale_db"], FULL_SCALES_DB)
    return SpeakerResponse(hertz, levels_db, bool(document.get("simulated", False)), full_scale_db)


def read_speaker_files(
    response: Path | None, patterns: Path | None, table: Mapping[str, Material]
) -> tuple[Playback, tuple[Pattern, ...]]:
    """Read the response and the patterns, if given; recordings are corrected by the response.

    Raises OSError, ValueError.
    """
    playback = NOMINAL if response is None else read_response(response).playback()
    if patterns is None:
        return playback, ()
    return playback, read_patterns(patterns, table, playback.correction)


def read_patterns(
    folder: Path,
    table: Mapping[str, Material],
    correction: Correction = Correction(),  # noqa: B008 - frozen
) -> tuple[Pattern, ...]:
    """Read every sound file of `folder`, corrected for the speaker.

    Files whose names begin with a dot are skipped: macOS puts `._NAME` beside each file.

    `table` holds the materials that may be named. Raises OSError, PatternError naming the file.
    """
    if not folder.is_dir():
        raise NotADirectoryError(f"{why_no_folder(folder)}; give one of recordings")
    files = sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in ENDINGS and not path.name.startswith(".")
    )
    if not 1 <= len(files) <= MAX_FILES:
        raise PatternError(
            f"{folder}: holds {len(files)} sound files ({', '.join(ENDINGS)}); it must hold 1 to "
            f"{MAX_FILES}"
        )
    paths: dict[tuple[str, str], Path] = {}
    patterns = []
    for path in files:
        recording = _read(path, table, correction)
        if recording.key in paths:
            names = f"{paths[recording.key].name} and {path.name}"
            raise PatternError(f"{folder}: {names} replace the same pattern; remove one")
        paths[recording.key] = path
        patterns.append(recording)
    return tuple(patterns)


def _numbers(
    path: Path, document: dict[str, object], field: str, limits: tuple[float, float]
) -> tuple[float, ...]:
    values = document.get(field)
    if not isinstance(values, list) or not 2 <= len(values) <= MAX_POINTS:
        raise ValueError(f"{path}: {field}: needs a list of 2 to {MAX_POINTS} numbers")
    return tuple(_number(path, field, value, limits) for value in values)


def _number(path: Path, field: str, value: object, limits: tuple[float, float]) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{path}: {field}: {str(value)[:40]!r} is not a number")
    if not math.isfinite(value) or not limits[0] <= value <= limits[1]:
        raise ValueError(f"{path}: {field}: {value} is not in {limits[0]:g}..{limits[1]:g}")
    return float(value)


def _read(path: Path, table: Mapping[str, Material], correction: Correction) -> Pattern:
    try:
        key = replaced_key(path.stem, table)
        samples, rate_hz = read_wav(path, LONGEST_S)
        recording = pattern(key, samples, rate_hz, correction, table)
    except ValueError as error:
        message = str(error)
        raise PatternError(message if str(path) in message else f"{path}: {message}") from None
    if recording.lead_s >= _TOLD_LEAD_S:
        logger.info("%s: the %.0f ms before its onset are cut", path, 1000 * recording.lead_s)
    return recording
