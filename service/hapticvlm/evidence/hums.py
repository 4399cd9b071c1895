"""Reads from an object's name how it vibrates by itself, by the table hums.toml. Pure."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from hapticvlm.evidence.names import words_of

TABLE = Path(__file__).with_name("hums.toml")


@dataclass(frozen=True, slots=True)
class NamedHum:
    """The fundamental, Hz; the level of each harmonic over the one before it; felt level 0..1."""

    frequency_hz: float
    richness: float
    level: float


def hum_of(name: str) -> NamedHum | None:
    """Return how an object of this name vibrates; None if the name implies no vibration."""
    words = words_of(name)
    for size in range(_longest(), 0, -1):
        for begin in range(len(words) - size + 1):
            hum = _phrases().get(" ".join(words[begin : begin + size]))
            if hum is not None:
                return hum
    return None


@lru_cache(maxsize=1)
def _phrases() -> dict[str, NamedHum]:
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return {
        phrase: NamedHum(row["frequency_hz"], row["richness"], row["level"])
        for row in table.values()
        for phrase in row["words"]
    }


@lru_cache(maxsize=1)
def _longest() -> int:
    return max(len(phrase.split()) for phrase in _phrases())
