"""Belief over candidate answers from the log-probabilities a chat endpoint offers. Pure.

An endpoint gives, token by token along the one answer it gave, the few likeliest tokens of each
place. So the tree of answers is known along that answer and at its first branchings: after "2" was
chosen, how likely "21" or "22" was, but of the "1" not chosen only that it was likely. What is
not known is not guessed away: a branch not followed is spread evenly over the candidates that begin
like it, and what the likeliest tokens leave of 1 over all that were still possible there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vlm.endpoint import EndpointError, Json
from hapticvlm.vlm.numbers import CANDIDATES_C

SLACK = 0.01  # by which the probabilities of one place may exceed 1, for rounding

_NUMBER = re.compile(r"(-?)(\d{0,2})(.*)", re.DOTALL)

Doubles = NDArray[np.float64]
Fits = Callable[[str, bool], NDArray[np.bool_]]  # (text, whether it ends there) -> candidates


@dataclass(frozen=True, slots=True)
class Place:
    """A token of the answer, and what else could have stood there with its probability."""

    token: str
    likely: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class CandidateMass:
    """Mass on each candidate, (n,) float64: `seen` was given, `unseen` spreads what was not.

    What both lack to 1 went to answers that are no candidate.
    """

    seen: Doubles
    unseen: Doubles


def read_places(choice: Json) -> tuple[Place, ...]:
    """Read a choice's log-probabilities, () where it has none. Raises EndpointError."""
    found = choice.get("logprobs")
    if not found:
        return ()
    try:
        return tuple(_place(entry) for entry in found.get("content") or ())
    except (AttributeError, KeyError, TypeError):
        raise EndpointError("the endpoint's log-probabilities have no known form") from None


def follow(places: Sequence[Place], fits: Fits, *, is_whole: bool) -> CandidateMass:
    """Follow an answer through its places. `is_whole`: it ended by itself and was not cut."""
    count = fits("", False).size
    seen = np.zeros(count)
    unseen = np.zeros(count)
    text = ""
    mass = 1.0
    has_ended = False
    for place in places:
        for token, probability in place.likely:
            if token != place.token:
                seen += mass * probability * _even(_after(fits, text, token))
        left = max(0.0, 1.0 - sum(probability for _, probability in place.likely))
        unseen += mass * left * _even(fits(text, False))
        mass *= dict(place.likely)[place.token]
        has_ended = _ends(place.token)
        if has_ended:
            break
        text += place.token
    seen += mass * _even(fits(text, has_ended or is_whole))
    return CandidateMass(seen, unseen)


def fit_number(text: str, has_ended: bool) -> NDArray[np.bool_]:
    """Return which of CANDIDATES_C an answer that begins with `text` may be: (91,)."""
    parts = _NUMBER.match(text.strip().replace("\N{MINUS SIGN}", "-"))
    sign, digits, rest = parts.groups() if parts is not None else ("", "", text)
    if not rest and not has_ended:
        begun = sign + digits
        return np.array([str(candidate).startswith(begun) for candidate in CANDIDATES_C.tolist()])
    if not digits or rest[:1].isdigit():
        return np.zeros(CANDIDATES_C.size, dtype=np.bool_)
    is_it: NDArray[np.bool_] = np.equal(CANDIDATES_C, int(sign + digits))
    return is_it


def fit_word(words: Sequence[str]) -> Fits:
    """Return a test of which words an answer that begins with a text may be."""

    def fits(text: str, has_ended: bool) -> NDArray[np.bool_]:
        begun = text.strip().lower()
        complete = max((w for w in words if begun.startswith(w.lower())), key=len, default=None)
        longer = [not has_ended and word.lower().startswith(begun) for word in words]
        is_complete = np.array([word == complete for word in words])
        fitting: NDArray[np.bool_] = np.logical_or(is_complete, longer)
        return fitting

    return fits


def _place(entry: Json) -> Place:
    answered = (str(entry["token"]), _probability(entry["logprob"]))
    likely = {str(e["token"]): _probability(e["logprob"]) for e in entry.get("top_logprobs") or ()}
    likely.setdefault(*answered)
    total = sum(likely.values())
    if total > 1.0 + SLACK:
        raise EndpointError(f"the endpoint's probabilities of one place sum to {total:.3g}")
    return Place(answered[0], tuple(likely.items()))


def _probability(logprob: object) -> float:
    if isinstance(logprob, bool) or not isinstance(logprob, int | float):
        raise TypeError
    if not logprob <= SLACK:
        raise EndpointError(f"the endpoint gives {logprob} as a log-probability")
    return math.exp(logprob)


def _after(fits: Fits, text: str, token: str) -> NDArray[np.bool_]:
    return fits(text, True) if _ends(token) else fits(text + token, False)


def _ends(token: str) -> bool:
    """Whether a token ends an answer: special ones are given as such or as nothing at all."""
    return not token or token.startswith(("<|", "</"))


def _even(fitting: NDArray[np.bool_]) -> Doubles:
    share: Doubles = fitting / max(1, int(fitting.sum()))
    return share
