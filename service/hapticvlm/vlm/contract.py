"""Defines the questions to a vision-language model, word for word, and its interface. Pure.

Everything that is the same for all pictures stands before the picture, so that the model's cache of
it can be kept. After the picture comes one short question, in several wordings. Knows no model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials, messages
from hapticvlm.errors import HapticVLMError
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm.limits import ANSWER_S, HALF_WIDTH_C, IMAGE_TOKENS, LEAST_C, MOST_C

DEFAULT_MODEL = "Qwen/Qwen2-VL-2B-Instruct"

Picture = NDArray[np.uint8]


class VlmError(HapticVLMError):
    """The model cannot be loaded or asked, or its answer is unusable; the message says why."""


@dataclass(frozen=True, slots=True)
class VlmSettings:
    """The model to use. With a `url` it is asked over HTTP, else it is loaded in the process.

    `image_tokens` is the largest number of tokens that a picture becomes: fewer are faster and show
    less. `token` is sent to the endpoint as a bearer token, or as it is in a header of the name
    `header`.
    """

    model: str = DEFAULT_MODEL
    url: str | None = None
    token: str | None = field(default=None, repr=False)
    header: str | None = None
    device: str = "cpu"
    threads: int = 1
    image_tokens: int = IMAGE_TOKENS
    timeout_s: float = ANSWER_S


class Vlm(Protocol):
    """A loaded model or an endpoint. Calls block, so they are made in a process of their own."""

    @property
    def name(self) -> str:
        """The name of the model, as in the settings."""

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError."""

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask for the object's material: evidence of rung vlm over `names`. Raises VlmError.

        `context` is the frame with the object outlined, `crop` the object, both (H, W, 3) uint8.
        """


COLOUR = (255, 0, 0)  # called red in the question
THICKNESS = 0.012  # of the shorter side: three pixels of 224, still visible at 64 image tokens

AMBIENT_INSTRUCTION = (
    "You judge how warm a place is from a picture of it. Mind whether it is indoors or outdoors, "
    "the season, sun or shade, plants, snow, ice, steam, fire and what people wear. "
    "Give the temperature of the air in degrees Celsius, "
    f"as one whole number from {LEAST_C} to {MOST_C} and nothing else."
)
AMBIENT_QUESTIONS = (
    "What is the air temperature here, in degrees Celsius?",
    "How many degrees Celsius is it in this place?",
)


def box(picture: Picture, region: messages.Region) -> tuple[int, int, int, int]:
    """Return top, left, bottom and right of a region in a picture (H, W, 3), in whole px."""
    height, width = picture.shape[:2]
    bottom, right = (region.y + region.h) * height, (region.x + region.w) * width
    return int(region.y * height), int(region.x * width), ceil(bottom), ceil(right)


def highlight(picture: Picture, region: messages.Region) -> Picture:
    """Return a copy of a picture (H, W, 3) uint8 with an outline around a region.

    The line lies outside the region but inside the picture. An empty region leaves no outline.
    """
    height, width = picture.shape[:2]
    by = max(2, round(THICKNESS * min(height, width)))
    top, left, bottom, right = box(picture, region)
    outlined = picture.copy()
    if bottom <= top or right <= left:
        return outlined
    outlined[max(0, top - by) : bottom + by, max(0, left - by) : right + by] = COLOUR
    fills = top <= 0 and left <= 0 and bottom >= height and right >= width
    inset = by if fills else 0
    inside = np.s_[top + inset : bottom - inset, left + inset : right - inset]
    outlined[inside] = picture[inside]
    return outlined


@dataclass(frozen=True, slots=True)
class QuestionText:
    """An instruction before the pictures, and the wordings of a question after them.

    briefly: what is added when an answer could not be read.
    """

    instruction: str
    questions: tuple[str, ...]
    briefly: str


def about_ambient() -> QuestionText:
    """Ask for the air temperature in two wordings; answers that differ make a wide interval."""
    return QuestionText(AMBIENT_INSTRUCTION, AMBIENT_QUESTIONS, "Answer with the number alone.")


def about_material(names: Sequence[str]) -> QuestionText:
    """Ask for the material of the object outlined in the first picture, alone in the second."""
    listed = ", ".join(names)
    instruction = (
        "In the first picture one object is outlined in red; the second picture shows it alone. "
        f"Say what its surface is made of, with one word of: {listed}, {materials.UNKNOWN}."
    )
    question = "What is the outlined object made of?"
    return QuestionText(instruction, (question,), "Answer with that one word alone.")


def widened(value_c: float, low_c: float, high_c: float) -> tuple[float, float]:
    """Widen an interval, degC, to at least HALF_WIDTH_C on either side of the value."""
    return min(low_c, value_c - HALF_WIDTH_C), max(high_c, value_c + HALF_WIDTH_C)
