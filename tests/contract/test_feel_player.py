"""The JavaScript player of a feel file: its golden vectors, and what strangers send."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from node_programs import printed

import player_vectors as vectors
from hapticvlm.rendering.vibration.vibration import INTERACTIONS

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
        said = [case["says"]] if case["says"] else []
        assert (case["name"], one["plan"], one["said"]) == (case["name"], like["plan"], said)


def test_a_time_that_is_not_in_seconds_is_named(hostile: Json) -> None:
    for case, answer in zip(HOSTILE["times"], hostile["times"], strict=True):
        assert answer["said"] == ([case["says"]] if case["says"] else []), case["name"]
        assert all(map(is_finite, answer["plans"]))


def test_a_wrong_file_is_refused_with_its_field(hostile: Json) -> None:
    for case, message in zip(HOSTILE["files"], hostile["files"], strict=True):
        assert (message or "felt").startswith(case["field"]), case["name"]


def test_no_touch_of_a_grid_gives_a_number_that_is_not_finite() -> None:
    numbers = (0.4, *({"$number": name} for name in ("NaN", "Infinity", "-Infinity")), -1.0, 1e300)
    moved = [(speed, force) for speed in (*numbers, None) for force in (*numbers, "fast")]
    touches = [
        {"phase": phase, "hand": "left", "interaction": kind, "speed_mps": speed, "force_n": force}
        for phase in ("approach", "contact", "slide")
        for kind in (None, *INTERACTIONS)
        for speed, force in moved
    ]
    asked = [{"touch": touch, "like": None} for touch in touches]
    answers = played("hostile", {"touches": asked, "times": [], "files": []})["touches"]
    assert all(is_finite(one["plan"]) for one, _ in answers)
    assert sum(bool(one["plan"]["amplitude"]) for one, _ in answers) > len(answers) / 3


def is_finite(plan: Json) -> bool:
    """Whether each number of a plan is one; JSON has null for those that are not finite."""
    numbers = [*plan["amplitude"], *plan["frequency_hz"]]
    numbers += [one[name] for one in plan["transients"] for name in ("amplitude", "frequency_hz")]
    return all(isinstance(number, int | float) for number in numbers)


@pytest.fixture(scope="module")
def felt() -> dict[str, Any]:
    """The motor's account of a scene whose service dies, freezes and comes back."""
    return dict(printed(HERE / "felt.mjs"))


def test_a_stroke_goes_on_while_the_service_dies_and_comes_back(felt: dict[str, Any]) -> None:
    for way in ("deaths", "freezes"):
        assert felt[way]["gap_ms"] <= 50
        assert felt[way]["by"] == ["baked", "service"]


def test_a_strike_is_played_whatever_the_service_does(felt: dict[str, Any]) -> None:
    strikes = ("strike after a freeze", "strike after a death", "strike long after")
    assert [felt[strike] for strike in strikes] == [pytest.approx(felt[strikes[2]], rel=0.05)] * 3
    assert felt[strikes[2]] > 0.5


def test_nothing_is_felt_after_a_stop_though_the_other_one_takes_over(felt: dict[str, Any]) -> None:
    assert felt["stop without one"]["isBack"]  # the service that began after the stop was there
    assert felt["stop by another"]["held"] == 0
    assert felt["stop of a missed strike"]["held"] == 0
    for case in ("stop with a service", "stop without one"):
        assert felt[case]["held"] == 0
        assert felt[case]["again"] > 0.5


def test_a_stop_is_the_reason_for_silence_while_the_touching_hand_is_held(
    felt: dict[str, Any],
) -> None:
    held, again = felt["stop with a service"]["silences"]
    assert held == "outputs stopped: release and touch again"
    assert again == ""  # though the hand that rests is still held


def test_the_mode_says_which_of_the_two_is_felt(felt: dict[str, Any]) -> None:
    assert felt["auto, service"] == {"felt": True, "by": "service", "silence": ""}
    assert felt["auto, none"] == {"felt": True, "by": "baked", "silence": ""}
    assert felt["baked, service"] == {"felt": True, "by": "baked", "silence": ""}
    assert felt["service, none"]["felt"] is False
    assert "no service answers" in felt["service, none"]["silence"]


def test_a_page_beside_another_plays_its_bake_and_says_why(felt: dict[str, Any]) -> None:
    beside = felt["a second page"]
    assert (beside["felt"], beside["by"]) == (True, "baked")
    assert beside["because"] == "another scene owns the outputs"
    assert beside["then"] == ["service", ""]
    assert beside["gap_ms"] <= 50


def test_a_hand_feels_no_object_that_left_the_scene(felt: dict[str, Any]) -> None:
    assert felt["an object that is gone"]["after"] == 0
    assert felt["an object that is gone"]["other"] > 0
