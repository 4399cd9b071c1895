"""From the choices of a chat endpoint to a reading or to evidence. Pure.

By log-probabilities where they were told and are mostly of candidates, else by the text. The value
is the expectation over what was told; the interval also counts what was not, evenly spread, and
reaches to the value where a long tail pulls that out of it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from hapticvlm.materials import UNKNOWN
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.vlm import wire
from hapticvlm.recognition.vlm.answers import Reading, VlmError
from hapticvlm.recognition.vlm.endpoint import Json
from hapticvlm.recognition.vlm.generation import interval, read_celsius
from hapticvlm.recognition.vlm.logprobs import Fits, Told, fit_number, fit_word, follow, read_places
from hapticvlm.recognition.vlm.numbers import spread

LEAST_TOLD = 0.5  # share of candidates below which log-probabilities are left for the text
# Belief in a material that was said without a probability: enough to be felt (ladder.KNOWN), not
# to end the climb (ladder.SURE). Set, not measured.
SAID_BELIEF = 0.6


def ambient_by_logprobs(choices: Sequence[Json], seconds: float) -> Reading | None:
    """Read a temperature off the log-probabilities, one choice a wording; None without them."""
    told = [_told(choice, fit_number) for choice in choices]
    known = [one for one in told if one is not None]
    if len(known) < len(told):
        return None
    value = spread([one.seen for one in known])
    ends = spread([one.seen + one.unseen for one in known])
    low_c, high_c = min(ends.low_c, value.value_c), max(ends.high_c, value.value_c)
    deviation = value.prompt_sd_c
    return Reading(value.value_c, low_c, high_c, deviation, "logprobs", seconds, value.share)


def ambient_by_text(choices: Sequence[Json], seconds: float) -> Reading:
    """Read the temperature that the texts state, one choice a wording. Raises VlmError.

    The interval holds those of all wordings.
    """
    stated = [read_celsius(wire.text_of(choice)) for choice in choices]
    lows, highs = zip(*(interval(one) for one in stated), strict=True)
    values = [one.value_c for one in stated]
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return Reading(float(np.mean(values)), min(lows), max(highs), deviation, "text", seconds)


def material_by_logprobs(choice: Json, names: Sequence[str]) -> Evidence | None:
    """Weigh material names by their log-probabilities; None without them."""
    told = _told(choice, fit_word((*names, UNKNOWN)))
    if told is None:
        return None
    beliefs = zip(names, told.seen.tolist(), strict=False)
    ranked = sorted((pair for pair in beliefs if pair[1] > 0), key=lambda pair: -pair[1])
    return Evidence("vlm", tuple(ranked))


def material_by_text(choice: Json, names: Sequence[str]) -> Evidence:
    """Take the one material that a text names, or none where it says unknown. Raises VlmError."""
    text = wire.text_of(choice)
    words = set(re.findall(r"\w+", text.lower()))
    said = [name for name in (*names, UNKNOWN) if name.lower() in words]
    if len(said) != 1:
        excerpt = " ".join(text.split())[:80]
        raise VlmError(f"the model's answer names {len(said)} materials: `{excerpt}`")
    return Evidence("vlm", () if said == [UNKNOWN] else ((said[0], SAID_BELIEF),))


def _told(choice: Json, fits: Fits) -> Told | None:
    """Follow the log-probabilities; None without them, or where most are of no candidate."""
    places = read_places(choice)
    if not places:
        return None
    told = follow(places, fits, is_whole=choice.get("finish_reason") == "stop")
    return told if told.seen.sum() >= LEAST_TOLD else None
