"""What a vision-language model is asked, word for word. Pure; knows no model.

All that is the same for every picture stands before it, so that its cache can be kept; what follows
the picture is one short question, in several wordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hapticvlm import materials
from hapticvlm.recognition.vlm.answers import LEAST_C, MOST_C

AMBIENT_INSTRUCTION = (
    "You judge how warm a place is from a picture of it. Mind whether it is indoors or outdoors, "
    "the season, sun or shade, plants, snow, ice, steam, fire and what people wear. "
    "Give the temperature of the air in degrees Celsius, "
    f"as one whole number from {LEAST_C} to {MOST_C} and nothing else."
)
AMBIENT_QUESTIONS = (
    "What is the air temperature here, in degrees Celsius?",
    "How many degrees Celsius is it in this place?",
    "Estimate the ambient temperature in degrees Celsius.",
    "A thermometer hangs here. What does it read, in degrees Celsius?",
)
MOST_WORDINGS = len(AMBIENT_QUESTIONS)


@dataclass(frozen=True, slots=True)
class Asked:
    """An instruction before the pictures and the wordings of the question after them."""

    instruction: str
    questions: tuple[str, ...]


def about_ambient(wordings: int) -> Asked:
    """Ask how warm it is, in 1 to MOST_WORDINGS wordings."""
    return Asked(AMBIENT_INSTRUCTION, AMBIENT_QUESTIONS[:wordings])


def about_material(names: Sequence[str]) -> Asked:
    """Ask what the outlined object of the first picture, alone in the second, is made of."""
    listed = ", ".join(names)
    instruction = (
        "In the first picture one object is outlined in red; the second picture shows it alone. "
        f"Say what its surface is made of, with one word of: {listed}, {materials.UNKNOWN}."
    )
    return Asked(instruction, ("What is the outlined object made of?",))
