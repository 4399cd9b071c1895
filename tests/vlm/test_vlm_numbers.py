"""Temperatures and names read off token probabilities, and temperatures read off sentences."""

from __future__ import annotations

import itertools
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from each_case import each, each_row
from numpy.typing import NDArray
from word_tables import words

from hapticvlm import messages
from hapticvlm.evidence.reading import COVERAGE
from hapticvlm.vlm.contract import COLOUR, VlmError, highlight, widened
from hapticvlm.vlm.limits import HALF_WIDTH_C, LEAST_C, MOST_C
from hapticvlm.vlm.numbers import (
    CANDIDATES_C,
    ChoiceTree,
    beliefs,
    choice_tree,
    number_beliefs,
    number_tree,
    pack,
    quantile,
    spread,
)
from hapticvlm.vlm.sentence import read_celsius

SIGNS = "-0123456789"
WORDS = partial(words, Path(__file__).with_name("answers.csv"))


def by_digit(text: str) -> list[int]:
    return [SIGNS.index(sign) for sign in text]


def whole(text: str) -> list[int]:
    """One token a number, as tokenizers that merge digits have it; the sign apart."""
    return [0, int(text[1:])] if text.startswith("-") else [int(text)]


def in_pairs(text: str) -> list[int]:
    """One token for the sign with its digit, as some merge them: -5 is one, -15 is two."""
    if not text.startswith("-"):
        return by_digit(text)
    return [20 + int(text[1]), *by_digit(text[2:])]


def planted(tree: ChoiceTree, text: tuple[int, ...], vocabulary: int = 300) -> NDArray[np.float32]:
    """Log-probabilities of a model that is sure of one text and of its end."""
    rows = np.full((len(tree.nodes), vocabulary), -50.0, np.float32)
    end = vocabulary - 1
    for row, node in zip(rows, tree.nodes, strict=True):
        row[text[len(node)] if node == text[: len(node)] and len(node) < len(text) else end] = 0.0
    return rows


def random_rows(tree: ChoiceTree, vocabulary: int = 300, seed: int = 0) -> NDArray[np.float32]:
    rows = np.random.default_rng(seed).normal(0, 3, (len(tree.nodes), vocabulary))
    return (rows - np.logaddexp.reduce(rows, axis=1, keepdims=True)).astype(np.float32)


@each(number=[-30, -17, -5, -1, 0, 2, 9, 22, 60], encode=[by_digit, whole, in_pairs])
def test_a_planted_number_is_read_back(encode, number: int) -> None:
    tree = number_tree(encode)
    found = spread([number_beliefs(tree, planted(tree, tuple(encode(str(number)))))])
    assert found.value_c == pytest.approx(number, abs=1e-6)
    assert found.low_c == pytest.approx(number - COVERAGE / 2, abs=1e-6)
    assert found.high_c == pytest.approx(number + COVERAGE / 2, abs=1e-6)
    assert found.share == pytest.approx(1.0, abs=1e-6)
    assert (found.prompt_sd_c, found.seconds) == (None, 0.0)


def test_a_digit_that_goes_on_is_not_the_number_it_begins_with() -> None:
    tree = number_tree(by_digit)
    rows = planted(tree, tuple(by_digit("2")))
    after_two = tree.nodes.index(tuple(by_digit("2")))
    rows[after_two] = -50.0
    rows[after_two, SIGNS.index("2")] = np.log(0.75)
    rows[after_two, 99] = np.log(0.25)
    found = number_beliefs(tree, rows)
    assert found[CANDIDATES_C == 22] == pytest.approx(0.75, abs=1e-6)
    assert found[CANDIDATES_C == 2] == pytest.approx(0.25, abs=1e-6)


def test_what_follows_a_number_does_not_matter() -> None:
    tree = number_tree(by_digit)
    said = planted(tree, tuple(by_digit("5")))
    after_five = tree.nodes.index(tuple(by_digit("5")))
    said[after_five] = -50.0
    said[after_five, 40:44] = np.log(0.25)  # an end, a degree sign, a full stop, a space
    assert number_beliefs(tree, said)[CANDIDATES_C == 5] == pytest.approx(1.0, abs=1e-6)


def test_beliefs_and_the_mass_of_other_answers_sum_to_one() -> None:
    tree = number_tree(by_digit)
    rows = random_rows(tree)
    first = np.exp(rows[0].astype(np.float64))
    after_minus = np.exp(rows[tree.nodes.index((0,))].astype(np.float64))
    digits = slice(SIGNS.index("1"), SIGNS.index("9") + 1)
    numbers = first[SIGNS.index("0")] + first[digits].sum() + first[0] * after_minus[digits].sum()
    assert beliefs(tree, rows).sum() == pytest.approx(numbers, abs=1e-6)


@each(encode=[by_digit, whole], said=["72", "100", "65", "-40", "199"])
def test_a_number_outside_the_candidates_is_not_read_as_its_beginning(encode, said) -> None:
    tree = number_tree(encode)
    assert number_beliefs(tree, planted(tree, tuple(encode(said)))).sum() < 1e-6


def test_by_digits_thirty_texts_beside_the_prompt_are_asked() -> None:
    assert len(number_tree(by_digit).nodes) == 30
    assert number_tree(whole).nodes == ((), (0,))


def test_every_whole_degree_is_a_candidate_once() -> None:
    tree = number_tree(by_digit)
    candidates = [answer for _, answer in tree.texts if answer < len(CANDIDATES_C)]
    assert sorted(candidates) == list(range(MOST_C - LEAST_C + 1))
    assert tree.answers == len(CANDIDATES_C) + 1  # and one for every other number


def test_several_spellings_of_one_answer_add_up() -> None:
    tree = choice_tree({"1": 0, "2": 1, "12": 0}, by_digit)
    rows = random_rows(tree)
    one, two = (float(np.exp(rows[0, SIGNS.index(sign)])) for sign in "12")
    assert beliefs(tree, rows) == pytest.approx([one, two], abs=1e-6)


def test_answers_that_share_their_tokens_are_refused() -> None:
    with pytest.raises(ValueError, match="does not distinguish"):
        choice_tree({"1": 0, "2": 1}, lambda _: [7])
    with pytest.raises(ValueError, match="does not distinguish"):
        choice_tree({"1": 0}, lambda _: [])


def test_wordings_count_equally_and_their_deviation_is_reported() -> None:
    sure, faint = np.zeros(len(CANDIDATES_C)), np.zeros(len(CANDIDATES_C))
    sure[CANDIDATES_C == 10] = 1.0
    faint[CANDIDATES_C == 20] = 0.6
    found = spread([sure, faint])
    assert found.value_c == pytest.approx(15.0)
    assert found.prompt_sd_c == pytest.approx(np.std([10, 20], ddof=1))
    assert found.low_c == pytest.approx(9.7)
    assert found.high_c == pytest.approx(20.3)
    assert found.share == pytest.approx(0.8)


def test_an_even_belief_has_its_interval_where_it_should() -> None:
    even = np.full(len(CANDIDATES_C), 1 / len(CANDIDATES_C))
    found = spread([even])
    assert found.value_c == pytest.approx((LEAST_C + MOST_C) / 2)
    wide = MOST_C - LEAST_C + 1
    assert found.high_c - found.low_c == pytest.approx(COVERAGE * wide)
    assert quantile(even, 0.5) == pytest.approx((LEAST_C + MOST_C) / 2)


def even(share: float) -> NDArray[np.float64]:
    return np.full(len(CANDIDATES_C), share / len(CANDIDATES_C))


@pytest.mark.parametrize("share", [0.0, 1e-9, 0.49, float("nan")])
def test_the_few_per_cent_a_sentence_leaves_to_numbers_are_not_a_temperature(share: float) -> None:
    with pytest.raises(VlmError, match="is a number"):
        spread([even(1.0), even(share)])
    assert spread([even(1.0), even(0.51)]).share == pytest.approx(0.755)


def test_packed_texts_see_their_own_beginning_alone() -> None:
    tree = number_tree(by_digit)
    tails = ([70, 71, 72], [80, 81])
    packed = pack(tails, tree)
    for wording, node in itertools.product(range(2), range(len(tree.nodes))):
        row = packed.rows[wording, node]
        seen = packed.ids[packed.sees[row]].tolist()
        assert seen == [*tails[wording], *tree.nodes[node]]
        steps = packed.steps[packed.sees[row]].tolist()
        assert steps == list(range(len(seen)))


@each_row(("text", "low", "high"), WORDS("stated"))
def test_a_stated_temperature_is_read(text: str, low: str, high: str) -> None:
    stated = read_celsius(text)
    assert (stated.low_c, stated.high_c) == pytest.approx((float(low), float(high)))
    assert stated.value_c == pytest.approx((float(low) + float(high)) / 2)


@each_row(("text",), WORDS("minus five"))
def test_each_language_has_its_own_minus(text: str) -> None:
    assert read_celsius(text).value_c == -5


@each_row(("text",), WORDS("no temperature"))
def test_an_answer_of_which_any_part_is_something_else_is_not_a_temperature(text: str) -> None:
    with pytest.raises(VlmError, match="the model's answer"):
        read_celsius(text)


def test_a_stated_number_is_believed_within_the_papers_tolerance() -> None:
    assert widened(22, 22, 22) == (22 - HALF_WIDTH_C, 22 + HALF_WIDTH_C)
    assert widened(15, 0, 30) == (0, 30)


def test_a_region_is_outlined_and_its_inside_unchanged() -> None:
    picture = np.full((100, 200, 3), 90, np.uint8)
    outlined = highlight(picture, messages.Region(x=0.25, y=0.25, w=0.5, h=0.5))
    assert COLOUR == (255, 0, 0)  # the question says red
    red = (outlined == COLOUR).all(axis=2)
    assert (outlined[~red] == 90).all()
    assert not red[25:75, 50:150].any()
    assert red[24, 48:152].all()
    assert red[23:77, 49].all()
    assert (picture == 90).all()


def test_an_object_that_fills_the_picture_is_outlined_within() -> None:
    picture = np.zeros((50, 50, 3), np.uint8)
    red = (highlight(picture, messages.Region(x=0, y=0, w=1, h=1)) == COLOUR).all(axis=2)
    assert red[0].all()
    assert red[:, -1].all()
    assert not red[10:40, 10:40].any()


def test_an_empty_region_leaves_the_picture_unchanged() -> None:
    picture = np.random.default_rng(1).integers(0, 255, (30, 40, 3), np.uint8)
    assert (highlight(picture, messages.Region(x=0.5, y=0.5, w=0.0, h=0.0)) == picture).all()
