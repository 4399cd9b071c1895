"""What a vision-language model is asked here, word for word, and what it answers. Pure.

All that is the same for every picture stands before it, so that its cache can be kept; what follows
the picture is one short question, in several wordings. Knows no model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
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
    """The model cannot be loaded or asked, or its answer is of no use; the text is the reason."""


@dataclass(frozen=True, slots=True)
class VlmSettings:
    """Which model to ask and how. With a `url` it is asked over HTTP, else loaded in process.

    `image_tokens` is the speed knob: the most tokens a picture may become. A `token` is sent to the
    endpoint as a bearer token.
    """

    model: str = DEFAULT_MODEL
    url: str | None = None
    token: str | None = field(default=None, repr=False)
    device: str = "cpu"
    threads: int = 1
    image_tokens: int = IMAGE_TOKENS
    timeout_s: float = ANSWER_S


class Vlm(Protocol):
    """A loaded model or an endpoint. Calls block; the caller is a process of its own."""

    @property
    def name(self) -> str:
        """Which model it is, as the settings name it."""

    @property
    def is_remote(self) -> bool:
        """Whether pictures leave this machine."""

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError."""

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask what the object is made of; evidence of rung vlm over `names`. Raises VlmError.

        `context` is the frame with the object outlined, `crop` the object, both (H, W, 3) uint8.
        """

    def close(self) -> None:
        """Release the model or the connection."""


COLOUR = (255, 0, 0)  # the prompt calls it red
THICKNESS = 0.012  # of the shorter side: three pixels of 224, still seen at 64 image tokens

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


def highlight(picture: Picture, region: messages.Region) -> Picture:
    """Return the picture (H, W, 3) uint8 with an outline around what a region marks.

    The line lies outside the object, within the picture. With nothing marked the picture comes back
    as it is.
    """
    height, width = picture.shape[:2]
    top = int(region.y * height)
    left = int(region.x * width)
    bottom, right = np.ceil([(region.y + region.h) * height, (region.x + region.w) * width])
    inside = np.zeros((height, width), bool)
    inside[top : int(bottom), left : int(right)] = True
    by = max(2, round(THICKNESS * min(picture.shape[:2])))
    line = _grow(inside, by) & ~inside
    if inside.any() and not line.any():
        line = inside & _grow(~inside, by, beyond=True)  # the object fills the picture
    outlined = picture.copy()
    outlined[line] = COLOUR
    return outlined


def _grow(inside: NDArray[np.bool_], by: int, *, beyond: bool = False) -> NDArray[np.bool_]:
    """Grow what is marked by so many pixels to every side, corners square; `beyond` the edge."""
    from scipy.ndimage import maximum_filter  # for those alone who ask about an object

    grown: NDArray[np.bool_] = maximum_filter(inside, 2 * by + 1, mode="constant", cval=beyond)
    return grown


@dataclass(frozen=True, slots=True)
class Asked:
    """An instruction before the pictures and the wordings of the question after them."""

    instruction: str
    questions: tuple[str, ...]


def about_ambient() -> Asked:
    """Ask how warm it is, in two wordings: where they differ the answer is worth less."""
    return Asked(AMBIENT_INSTRUCTION, AMBIENT_QUESTIONS)


def about_material(names: Sequence[str]) -> Asked:
    """Ask what the outlined object of the first picture, alone in the second, is made of."""
    listed = ", ".join(names)
    instruction = (
        "In the first picture one object is outlined in red; the second picture shows it alone. "
        f"Say what its surface is made of, with one word of: {listed}, {materials.UNKNOWN}."
    )
    return Asked(instruction, ("What is the outlined object made of?",))


def widened(value_c: float, low_c: float, high_c: float) -> tuple[float, float]:
    """Return the interval to believe of a reading, degC: at least HALF_WIDTH_C each way."""
    return min(low_c, value_c - HALF_WIDTH_C), max(high_c, value_c + HALF_WIDTH_C)
