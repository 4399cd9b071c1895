"""Belief from an endpoint's log-probabilities: exact where told, honest about what was not."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from each_case import each_row

from hapticvlm.vlm.endpoint import EndpointError
from hapticvlm.vlm.logprobs import CandidateMass, fit_number, fit_word, follow, read_places
from hapticvlm.vlm.numbers import CANDIDATES_C, spread

END = "<|im_end|>"


def choice(*places: tuple[str, Mapping[str, float]]) -> dict[str, Any]:
    return {
        "logprobs": {
            "content": [
                {
                    "token": said,
                    "logprob": math.log(likely[said]),
                    "top_logprobs": [
                        {"token": token, "logprob": math.log(p)} for token, p in likely.items()
                    ],
                }
                for said, likely in places
            ]
        }
    }


def told(*places: tuple[str, Mapping[str, float]], is_whole: bool = True) -> CandidateMass:
    return follow(read_places(choice(*places)), fit_number, is_whole=is_whole)


def at(belief: np.ndarray, number: int) -> float:
    return float(belief[np.flatnonzero(number == CANDIDATES_C)[0]])


def test_numbers_that_are_one_token_are_read_exactly() -> None:
    likely = {"21": 0.5, "22": 0.3, "-5": 0.15, "cold": 0.05}
    read = told(("21", likely), (END, {END: 1.0}))
    assert at(read.seen, 21) == pytest.approx(0.5)
    assert at(read.seen, 22) == pytest.approx(0.3)
    assert at(read.seen, -5) == pytest.approx(0.15)
    assert read.seen.sum() == pytest.approx(0.95)
    assert read.unseen.sum() == pytest.approx(0.0)
    assert spread([read.seen]).value_c == pytest.approx((21 * 0.5 + 22 * 0.3 - 5 * 0.15) / 0.95)


def test_digits_are_followed_along_the_answer() -> None:
    read = told(
        ("2", {"2": 0.8, "1": 0.2}), ("1", {"1": 0.5, "4": 0.25, END: 0.25}), (END, {END: 1.0})
    )
    assert at(read.seen, 21) == pytest.approx(0.4)
    assert at(read.seen, 24) == pytest.approx(0.2)
    assert at(read.seen, 2) == pytest.approx(0.2)


def test_a_branch_that_was_not_followed_is_spread_over_what_it_may_become() -> None:
    read = told(("2", {"2": 0.5, "1": 0.5}), ("5", {"5": 1.0}))
    assert at(read.seen, 25) == pytest.approx(0.5)
    teens = [at(read.seen, number) for number in (1, *range(10, 20))]
    assert teens == pytest.approx([0.5 / 11] * 11)


def test_unreported_mass_widens_the_interval_but_does_not_move_the_value() -> None:
    sure = told(("2", {"2": 1.0}), ("1", {"1": 1.0}))
    doubtful = told(("2", {"2": 0.8}), ("1", {"1": 0.7}))
    assert doubtful.seen.sum() + doubtful.unseen.sum() == pytest.approx(1.0)
    narrow, wide = spread([sure.seen]), spread([doubtful.seen + doubtful.unseen])
    assert narrow.high_c - narrow.low_c < 1.0
    assert wide.high_c - wide.low_c > 20.0
    assert spread([doubtful.seen]).value_c == pytest.approx(21.0)


@each_row(
    ("tokens", "number"),
    [
        (("-", "5", END), -5),
        (("\N{MINUS SIGN}", "1", "2"), -12),
        ((" ", "7", END), 7),
        (("0",), 0),
        (("2", "2", "°C"), 22),
        (("2", "2", ".", "5"), 22),
        (("60", ""), 60),
        (("3", "", "9"), 3),
    ],
)
def test_numbers_are_read_as_they_are_written(tokens: tuple[str, ...], number: int) -> None:
    read = told(*((token, {token: 1.0}) for token in tokens))
    assert at(read.seen, number) == pytest.approx(1.0)


@pytest.mark.parametrize("tokens", [("9", "0", "0"), ("100",), ("61",), ("It", " is"), ("-", END)])
def test_mass_on_other_answers_gives_no_belief(tokens: tuple[str, ...]) -> None:
    read = told(*((token, {token: 1.0}) for token in tokens))
    assert read.seen.sum() + read.unseen.sum() == pytest.approx(0.0)


def test_an_answer_that_was_cut_may_go_on() -> None:
    cut = told(("2", {"2": 1.0}), is_whole=False)
    assert at(cut.seen, 2) == pytest.approx(1 / 11)
    assert at(told(("2", {"2": 1.0})).seen, 2) == pytest.approx(1.0)


def test_beliefs_by_digits_are_within_the_unreported_mass() -> None:
    """Against the whole tree of a random model, of which an endpoint tells one path."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        first = rng.dirichlet(np.full(10, 0.3))
        second = rng.dirichlet(np.full(10, 0.3), size=10)
        exact = np.zeros(CANDIDATES_C.size)
        for tens in range(1, 6):
            for ones in range(10):
                exact[10 * tens + ones == CANDIDATES_C] = first[tens] * second[tens][ones]
        tens = int(np.argmax(first[1:6])) + 1
        ones = int(np.argmax(second[tens]))
        read = told(
            (str(tens), {str(d): float(p) for d, p in enumerate(first)}),
            (str(ones), {str(d): float(p) for d, p in enumerate(second[tens])}),
            (END, {END: 1.0}),
        )
        followed = (10 * tens <= CANDIDATES_C) & (10 * tens + 10 > CANDIDATES_C)
        assert np.allclose(read.seen[followed], exact[followed], atol=1e-9)
        assert read.seen.sum() + read.unseen.sum() <= 1.0 + 1e-9


def test_words_are_weighed_like_numbers() -> None:
    names = ("wood", "glass", "unknown")
    likely = {"w": 0.5, "gl": 0.3, "un": 0.1, "The": 0.1}
    read = follow(
        read_places(choice(("w", likely), ("ood", {"ood": 0.9, "ax": 0.1}))),
        fit_word(names),
        is_whole=True,
    )
    assert read.seen == pytest.approx([0.45, 0.3, 0.1])


def test_the_longer_of_two_names_that_begin_alike_is_meant() -> None:
    fits = fit_word(("oak", "oak_dark"))
    assert fits("Oak_dark.", True).tolist() == [False, True]
    assert fits("oak", True).tolist() == [True, False]
    assert fits("oak", False).tolist() == [True, True]


@pytest.mark.parametrize(
    "logprobs",
    [
        {"content": [{"token": "2", "logprob": 0.7}]},
        {"content": [{"token": "2", "logprob": float("nan")}]},
        {
            "content": [
                {
                    "token": "2",
                    "logprob": -0.1,
                    "top_logprobs": [{"token": "1", "logprob": -0.1}],
                }
            ]
        },
    ],
)
def test_log_probabilities_that_cannot_be_are_refused(logprobs: object) -> None:
    with pytest.raises(EndpointError):
        read_places({"logprobs": logprobs})


@pytest.mark.parametrize("logprobs", [None, {}, {"content": None}, {"content": []}])
def test_log_probabilities_may_be_missing(logprobs: object) -> None:
    assert read_places({"logprobs": logprobs}) == ()


@pytest.mark.parametrize(
    "logprobs",
    [
        {"content": [{"token": "2", "logprob": "-0.1"}]},
        {"content": [{"token": "2", "logprob": True}]},
        {"content": [{"token": "2"}]},
        {"content": ["2"]},
        {"content": 7},
        ["2"],
        None,
    ],
)
def test_log_probabilities_of_another_form_leave_the_answer_to_its_text(logprobs: object) -> None:
    assert read_places({"logprobs": logprobs}) == ()
