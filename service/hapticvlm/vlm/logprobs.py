"""Computes beliefs in candidate answers from the log-probabilities of a chat endpoint. Pure.

An endpoint returns one answer, and for each of its tokens the few most likely alternatives with
their log-probabilities. So the tree of possible answers is known only along that answer and at the
first step away from it. Say the answer is "21". Then the probabilities of "22" and "23" are known,
because they share the first token. Of an alternative first token "1" only its own probability is
known, and not whether it would have become "10" or "19".

The unknown part is kept, not dropped. The mass of an alternative is spread evenly over all
candidates that begin with it (`seen`: the endpoint reported it). The mass that the reported tokens
of a place lack to 1 is spread evenly over all candidates that were still possible there (`unseen`).
The value of a reading uses the seen mass alone; its interval uses both.
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

SLACK = 0.01  # by which rounding may make the probabilities of one place exceed 1

_NUMBER = re.compile(r"(-?)(\d{0,2})(.*)", re.DOTALL)

Doubles = NDArray[np.float64]
Fits = Callable[[str, bool], NDArray[np.bool_]]  # (beginning, has it ended) -> fitting candidates


@dataclass(frozen=True, slots=True)
class Place:
    """A token of the answer, and the probabilities of the likely tokens at its place."""

    token: str
    likely: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class CandidateMass:
    """Probability mass on each candidate, (n,) float64, reported (`seen`) and not (`unseen`).

    The part that both lack to 1 is on answers that are not candidates.
    """

    seen: Doubles
    unseen: Doubles


def read_places(choice: Json) -> tuple[Place, ...]:
    """Read a choice's log-probabilities, () where it has none or they have an unknown form.

    An answer without them is read from its text. Raises EndpointError for impossible ones.
    """
    logprobs = choice.get("logprobs")
    if not logprobs:
        return ()
    try:
        return tuple(_place(entry) for entry in logprobs.get("content") or ())
    except (AttributeError, KeyError, TypeError):
        return ()


def follow(places: Sequence[Place], fits: Fits, *, is_whole: bool) -> CandidateMass:
    """Add up the mass on candidates along an answer. `is_whole`: it ended by itself, uncut."""
    count = fits("", False).size
    seen = np.zeros(count)
    unseen = np.zeros(count)
    text = ""
    mass = 1.0  # the probability of the answer up to this place
    has_ended = False
    for place in places:
        # Of the mass that arrives here, each alternative takes its share, the unreported rest is
        # spread over all that is possible, and the answer's own token carries the remainder on.
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
    """Return which of CANDIDATES_C an answer that begins with `text` may be: (91,) bool."""
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
    """Return a function that tells which words an answer that begins with a text may be."""

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
        raise EndpointError(f"the endpoint's probabilities of one token sum to {total:.3g}, not 1")
    return Place(answered[0], tuple(likely.items()))


def _probability(logprob: object) -> float:
    if isinstance(logprob, bool) or not isinstance(logprob, int | float):
        raise TypeError
    if not logprob <= SLACK:
        raise EndpointError(
            f"the endpoint gives {logprob} as a log-probability; it must be 0 or less"
        )
    return math.exp(logprob)


def _after(fits: Fits, text: str, token: str) -> NDArray[np.bool_]:
    return fits(text, True) if _ends(token) else fits(text + token, False)


def _ends(token: str) -> bool:
    """Whether a token ends an answer; endpoints write special tokens as such or as ""."""
    return not token or token.startswith(("<|", "</"))


def _even(fitting: NDArray[np.bool_]) -> Doubles:
    share: Doubles = fitting / max(1, int(fitting.sum()))
    return share
