"""A folder of recordings that stand in for synthesised patterns: MATERIAL-INTERACTION.wav."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hapticvlm.devices.audio import read_wav
from hapticvlm.materials import Material
from hapticvlm.rendering.equaliser import Correction
from hapticvlm.rendering.patterns import LONGEST_S, Pattern, PatternError, named, pattern

MAX_FILES = 200


def read_patterns(
    folder: Path,
    table: Mapping[str, Material],
    correction: Correction = Correction(),  # noqa: B008 - frozen
) -> tuple[Pattern, ...]:
    """Read every WAV file of `folder`. Raises OSError, PatternError naming the file."""
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder}: no such folder")
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".wav")
    if not 1 <= len(files) <= MAX_FILES:
        raise PatternError(f"{folder}: {len(files)} WAV files, needs 1 to {MAX_FILES}")
    found: dict[tuple[str, str], Path] = {}
    patterns = []
    for path in files:
        made = _read(path, table, correction)
        if made.key in found:
            twice = f"{found[made.key].name} and {path.name} stand for the same; remove one"
            raise PatternError(f"{folder}: {twice}")
        found[made.key] = path
        patterns.append(made)
    return tuple(patterns)


def _read(path: Path, table: Mapping[str, Material], correction: Correction) -> Pattern:
    try:
        key = named(path.stem, table)
        samples, rate_hz = read_wav(path, LONGEST_S)
        return pattern(key, samples, rate_hz, correction, table)
    except ValueError as error:
        text = str(error)
        raise PatternError(text if str(path) in text else f"{path}: {text}") from None
