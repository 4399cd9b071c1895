"""Asks one method about the air temperature of every picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hapticvlm.commands.progress import track
from hapticvlm.evidence.ambient import DEFAULT_C, DEFAULT_HIGH_C, DEFAULT_LOW_C
from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm.contract import Picture, Vlm, VlmError
from hapticvlm.vlm.remote import RestingError
from hapticvlm_studio.evaluation.pictures import LabelledPicture, read_picture
from hapticvlm_studio.evaluation.scores import Guess

Ask = Callable[[Picture], Guess | None]

PATIENCE_S = 60.0  # how long to wait for an endpoint that rests after a failure, per picture


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer to a picture: a guess, or None and the reason; and the time it took in s."""

    labelled: LabelledPicture
    guess: Guess | None
    why_not: str
    seconds: float


def by_default(_picture: Picture) -> Guess:
    """Return the service's default for every picture."""
    return Guess(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C)


def by_vlm(vlm: Vlm) -> Ask:
    """Return a function that asks a model or an endpoint, and waits while the latter rests."""

    def ask(picture: Picture) -> Guess:
        reading = _patiently(vlm, picture)
        return Guess(reading.value_c, reading.low_c, reading.high_c)

    return ask


def ask_all(ask: Ask, pictures: Sequence[LabelledPicture]) -> list[Answered]:
    """Ask about every picture, with a progress bar. Raises LabelledPictureError.

    A method that fails is recorded as an answer without a guess.
    """
    return [_answer(ask, labelled) for labelled in track(pictures, "asking about each picture")]


def _answer(ask: Ask, labelled: LabelledPicture) -> Answered:
    picture = read_picture(labelled)
    started = time.monotonic()
    try:
        guess = ask(picture)
        why_not = "gives no answer"
    except VlmError as error:
        guess = None
        why_not = str(error)
    return Answered(labelled, guess, "" if guess else why_not, time.monotonic() - started)


def _patiently(vlm: Vlm, picture: Picture) -> Reading:
    """Ask, and retry once a failing endpoint has rested. Raises VlmError.

    In the service an endpoint that failed is not asked for a while, so that a scene does not wait
    for it. Here nobody waits, and a picture dropped for that reason would be a hole in the figures.
    """
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return vlm.ambient(picture)
        except RestingError as error:
            if time.monotonic() + error.seconds > deadline:
                raise
            time.sleep(error.seconds)
