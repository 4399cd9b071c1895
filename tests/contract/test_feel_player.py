"""The JavaScript player of a feel file: its golden vectors, and what strangers send."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import switch_cases
from node_programs import printed

import player_vectors as vectors

pytestmark = pytest.mark.process

Json = dict[str, Any]
HERE = Path(__file__).parent
VECTORS = HERE.parents[1] / "schemas" / "vectors"
HOSTILE: Json = json.loads((VECTORS / "player_hostile.json").read_text())


def played(what: str, cases: Any) -> Any:
    """Return what the player made of cases: plans, sounds, or answers to hostile ones."""
    return printed(HERE / "play_feel.mjs", what, cases=cases)


@pytest.fixture(scope="module")
def hostile() -> Json:
    return dict(played("hostile", HOSTILE))


def test_it_plans_every_golden_touch_as_the_reference_player_does() -> None:
    cases = json.loads((VECTORS / "player.json").read_text())
    pairs = zip(cases, played("plans", cases), strict=True)
    assert [problem for pair in pairs for problem in vectors.plan_problems(*pair)] == []


def test_it_renders_every_golden_touch_as_the_reference_player_does() -> None:
    cases = json.loads((VECTORS / "player_sound.json").read_text())
    waves = [np.frombuffer(base64.b64decode(wave)) for wave in played("sounds", cases)]
    pairs = zip(cases, waves, strict=True)
    assert [problem for pair in pairs for problem in vectors.problems(*pair)] == []


def test_a_hostile_touch_is_felt_as_the_one_that_the_service_would_feel(hostile: Json) -> None:
    for case, (one, like) in zip(HOSTILE["touches"], hostile["touches"], strict=True):
        told = vectors.said(one["said"])
        assert (case["name"], one["plan"], told) == (case["name"], like["plan"], vectors.says(case))


def test_a_time_that_is_not_in_seconds_is_named(hostile: Json) -> None:
    for case, answer in zip(HOSTILE["times"], hostile["times"], strict=True):
        assert vectors.said(answer["said"]) == vectors.says(case), case["name"]
        assert all(map(vectors.is_in_range, answer["plans"]))


def test_a_call_of_an_unknown_hand_or_form_is_refused_in_words(hostile: Json) -> None:
    for case, answer in zip(HOSTILE["calls"], hostile["calls"], strict=True):
        assert (answer["isHeld"], answer["plan"]["amplitude"]) == (False, [])
        assert vectors.said(answer["said"]) == vectors.says(case), case


def test_a_wrong_file_is_refused_with_its_field(hostile: Json) -> None:
    for case, message in zip(HOSTILE["files"], hostile["files"], strict=True):
        assert (message or "felt").startswith(case["field"]), case["name"]


def test_no_touch_of_a_grid_gives_a_number_out_of_range() -> None:
    answers = played("hostile", {"touches": vectors.grid()})["touches"]
    assert all(vectors.is_in_range(one["plan"]) for one, _ in answers)
    assert sum(bool(one["plan"]["amplitude"]) for one, _ in answers) > len(answers) / 2


@pytest.fixture(scope="module")
def felt() -> Json:
    """The motor's account of a scene whose service dies, freezes and comes back."""
    return dict(printed(HERE / "felt.mjs", cases=switch_cases.CASES))


def test_the_switch_between_service_and_bake_does_as_the_scripts_say(felt: Json) -> None:
    assert switch_cases.problems(felt["said"], "sound") == []
    assert "no service answers" in felt["said"]["mode service alone"]["why"]


def test_a_call_with_a_value_of_no_sense_does_no_harm(felt: Json) -> None:
    assert "openFeel" in felt["odd"].pop("raw")
    assert "no name" in felt["odd"].pop("nameless")
    assert felt["odd"] == {"thrown": [], "inherited": [], "saidTwice": []}


def test_a_hand_feels_no_object_that_left_the_scene(felt: Json) -> None:
    assert felt["gone"]["after"] == 0
    assert felt["gone"]["other"] > 0
