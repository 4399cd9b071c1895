"""A decision in a few plain words, for the terminal and for the film."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SOURCES = {
    "scene": "the scene says so",
    "name": "by its name",
    "shader": "by its shader",
    "encoder": "by sight",
    "vlm": "by the VLM",
    "unknown": "not sure enough",
}


def confidence_text(decision: Mapping[str, Any]) -> str:
    """Return how sure, and by what: `97 % sure, by its name`."""
    source = SOURCES[decision["source"]]
    if decision["source"] == "scene":
        return source
    if decision["material"] == "unknown":
        guess = decision.get("runner_up")
        return f"{source}; perhaps {guess}" if guess else source
    return f"{decision['confidence']:.0%} sure, {source}".replace("%", " %")


def degrees(decision: Mapping[str, Any]) -> str:
    """Return what skin is to feel: `skin should feel 23.9 °C`."""
    contact_c = decision.get("contact_c")
    return "" if contact_c is None else f"skin should feel {contact_c:.1f} °C"
