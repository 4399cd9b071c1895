"""The C# player of a feel file in Mono: its golden vectors and hostile cases."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path
from typing import Any

import identity
import mono
import numpy as np
import pytest
from pace import PACE

SCHEMAS = Path(__file__).parents[2] / "schemas"
sys.path.insert(0, str(SCHEMAS))
import player_vectors as vectors  # noqa: E402

pytest_plugins = ("mono_build",)
SHIPPED = mono.PACKAGE / "Runtime" / "Baked" / "Resources" / "HapticVLM"
FEELS = [str(SHIPPED / f"feel.{voice}.json") for voice in ("true", "sound")]
PLANS, SOUNDS, HOSTILE = (
    json.loads((SCHEMAS / "vectors" / f"{name}.json").read_text())
    for name in ("player", "player_sound", "player_hostile")
)
# Numbers that JSON has not come into no file that is parsed.
TEXTS = ("", "[", '"\\u12"', '"\\uZZZZ"', '{"version": NaN}', '{"version": 1e}')  # not JSON
FILES = [case for case in HOSTILE["files"] if "$number" not in json.dumps(case.get("value"))]
SLIDE: dict[str, Any] = {"phase": "slide", "object_id": "wood", **vectors.MOTION}
SLIDES = [{"touch": {**SLIDE, "hand": hand}} for hand in ("left", "right")]
MUTE, UNMUTE = ({"mute": "left", "on": on} for on in (True, False))
LEFT, RIGHT = ({"plan": hand} for hand in ("left", "right"))
MUTED: list[dict[str, Any]] = [*SLIDES, MUTE, *SLIDES, LEFT, RIGHT, UNMUTE, *SLIDES, LEFT]
Answers = dict[str, list[Any]]


def touched(case: dict[str, Any], like: str = "") -> dict[str, Any]:
    """Return a hostile touch, or the one that it is felt like, as the events of a case."""
    touch = case["like" if like else "touch"]
    hand = touch["hand"] if touch else "right"
    felt = [{"touch": {**touch, "object_id": "cup"}, "at_s": 5.0}] if touch else []
    surfaces = {"cup": case.get(f"{like}surface", {"material": "wood"})}
    events = [*felt, {"plan": hand, "at_s": 5.02}]
    return {"events": events, "surfaces": surfaces, "gain": case.get(f"{like}gain")}


def timed(case: dict[str, Any]) -> dict[str, Any]:
    touch = {
        "phase": case.get("phase", "slide"),
        "hand": "right",
        "object_id": "wood",
        **vectors.MOTION,
    }
    events = [
        ({"touch": touch, "at_s": now}, {"plan": "right", "at_s": now}) for now in case["times"]
    ]
    return {"events": [event for pair in events for event in pair]}


@pytest.fixture(scope="module")
def answers(build: mono.Build) -> Answers:
    """What the player makes of all cases, in their order."""
    hostile = [case for one in HOSTILE["touches"] for case in (touched(one), touched(one, "like_"))]
    plans = [*PLANS, *hostile, *map(timed, HOSTILE["times"])]
    plans += map(touched, vectors.grid())
    plans.append({"events": [{**each, "at_s": 0.02 * at} for at, each in enumerate(MUTED)]})
    whole = json.loads(Path(FEELS[0]).read_text())
    files = [*(json.dumps(vectors.edited(whole, case)) for case in FILES), *TEXTS]
    cases = json.dumps(
        {"plans": plans, "calls": HOSTILE["calls"], "sounds": SOUNDS, "files": files}
    )
    played: Answers = json.loads(build.run("baked.exe", *FEELS, text=cases, timeout=300.0 * PACE))
    return played


def test_it_plans_as_the_golden_vectors_say(answers: Answers) -> None:
    pairs = zip(PLANS, answers["plans"], strict=False)
    assert [problem for pair in pairs for problem in vectors.plan_problems(*pair)] == []


def test_it_renders_as_the_golden_vectors_say_and_takes_no_memory(answers: Answers) -> None:
    waves = [np.frombuffer(base64.b64decode(each["wave"]), "<f4") for each in answers["sounds"]]
    pairs = zip(SOUNDS, waves, strict=True)
    found = [each for case, wave in pairs for each in vectors.problems(case, wave)]
    assert [each for each in found if not each.startswith("step ")] == []
    assert len(found) <= sum(len(case["levels"]) for case in SOUNDS) / 100
    assert {each["bytes"] for each in answers["sounds"]} == {0.0}


def test_a_hostile_touch_is_felt_as_the_one_that_the_service_would_feel(answers: Answers) -> None:
    cases = [*HOSTILE["touches"], *HOSTILE["times"]]
    played = answers["plans"][len(PLANS) : -1 - len(vectors.grid())]
    pairs = played[: 2 * len(HOSTILE["touches"])]
    told = [*pairs[::2], *played[len(pairs) :]]
    for case, each in zip(cases, told, strict=True):
        assert vectors.said(each["said"]) == 2 * vectors.says(case), case["name"]
    for case, one, like in zip(HOSTILE["touches"], pairs[::2], pairs[1::2], strict=True):
        assert one["events"][-1] == like["events"][-1], case["name"]


def test_no_touch_of_a_grid_gives_a_number_out_of_range(answers: Answers) -> None:
    played = [each for one in answers["plans"][len(PLANS) : -1] for each in one["events"]]
    plans = [plan for each in played for plan in each.values() if plan]
    assert all(map(vectors.is_in_range, plans))
    assert sum(bool(plan["amplitude"]) for plan in plans) > len(vectors.grid())


def test_a_call_of_an_unknown_hand_or_form_is_refused_in_words(answers: Answers) -> None:
    for case, answer in zip(HOSTILE["calls"], answers["calls"], strict=True):
        assert answer["state"] == f"{case['hand'] == 'right'} False"
        assert answer["plan"]["amplitude"] == []
        assert vectors.said(answer["said"]) == vectors.says(case), case


def test_a_muted_hand_is_silent_and_the_other_one_is_not(answers: Answers) -> None:
    plans = [each["amplitude"] for each in answers["plans"][-1]["events"] if each["amplitude"]]
    assert [bool(plan["amplitude"]) for plan in plans] == [False, True, True]


def test_a_wrong_file_is_refused_with_its_field_and_what_to_do(answers: Answers) -> None:
    for case, said in zip(FILES, answers["files"], strict=False):
        assert said.startswith(f"{case['field']}: "), case["name"]
        assert "bake it again" in said


def test_a_text_that_is_not_json_is_refused_with_its_place(answers: Answers) -> None:
    assert {said[:21] for said in answers["files"][len(FILES) :]} == {"not JSON at character"}


def test_it_finds_things_in_a_bake_as_the_shared_cases_say(build: mono.Build) -> None:
    printed = build.run("baked.exe", str(identity.FILE), "identity", timeout=60.0 * PACE)
    assert identity.differences(json.loads(printed)) == []
