"""The JavaScript player of `feel.json` beside the service: the same touches, the same vibration."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from feel_parity import (
    FITTED,
    GOLDEN,
    HOSTILE,
    REFUSED,
    Deviation,
    assert_wrong_values_are_fitted,
    deviations,
)
from heard_parity import (
    TOUCHES,
    assert_is_the_sound_voice,
    assert_is_the_true_voice,
    sound_voice,
    true_voice,
)
from numpy.typing import NDArray
from pace import PACE
from toolchains import require

import feel_vectors
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import INTERACTIONS

pytestmark = pytest.mark.process

HERE = Path(__file__).parent
FEEL = HERE.parents[1] / "examples" / "webxr" / "client" / "feel.json"


@pytest.fixture(scope="module")
def golden() -> list[Deviation]:
    return deviations(GOLDEN, played(GOLDEN))


def played(cases: list[dict[str, Any]], feel: Path = FEEL) -> list[dict[str, Any]]:
    """Return the cases with the plans of the JavaScript player."""
    require("node")
    ran = subprocess.run(
        ["node", str(HERE / "play_feel.mjs"), str(feel)],
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        timeout=60.0 * PACE,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    answer: list[dict[str, Any]] = json.loads(ran.stdout)
    return answer


def test_it_plans_every_golden_touch_as_the_service_does(golden: list[Deviation]) -> None:
    assert len(golden) == len(MATERIALS) * len(INTERACTIONS) + 5
    assert [each for each in golden if not each.is_small] == []


def test_it_follows_leases_stops_and_both_hands_as_the_service_does(
    golden: list[Deviation],
) -> None:
    silent = [
        not event["amplitude"]["amplitude"]
        for case in GOLDEN
        if case["name"] == "a stop, its hold, and a touch after it"
        for event in case["events"]
        if "plan" in event
    ]
    assert silent == [False, True, True, True, False]
    rules = [each for each in golden if " " in each.name and each.name.split()[0] == "a"]
    assert len(rules) == 4
    assert max(each.amplitude for each in rules) < 0.03


def test_every_material_touch_and_speed_is_as_strong_as_the_services() -> None:
    cases = [
        feel_vectors.played(feel_vectors.touched(material, interaction, speed_mps))
        for material in MATERIALS
        for interaction in INTERACTIONS
        for speed_mps in feel_vectors.SPEEDS_MPS
    ]
    table = deviations(cases, played(cases))
    assert len(table) == len(MATERIALS) * len(INTERACTIONS) * 3
    assert [each for each in table if not each.is_small] == []


def test_a_wrong_value_is_taken_as_the_service_takes_it_and_a_wrong_word_is_not_felt() -> None:
    assert_wrong_values_are_fitted(played([*HOSTILE, *FITTED, *REFUSED]))


def test_a_file_of_another_version_is_refused_with_what_to_do(tmp_path: Path) -> None:
    require("node")
    other = tmp_path / "feel.json"
    other.write_text(json.dumps({**json.loads(FEEL.read_text()), "version": 2}))
    ran = subprocess.run(
        ["node", str(HERE / "play_feel.mjs"), str(other)],
        input="[]",
        capture_output=True,
        text=True,
        timeout=60.0 * PACE,
        check=False,
    )
    assert ran.returncode != 0
    assert "bake it again" in ran.stderr


@pytest.fixture(scope="module")
def felt() -> dict[str, Any]:
    """The motor's account of a scene whose service dies, freezes and comes back."""
    require("node")
    ran = subprocess.run(
        ["node", str(HERE / "felt.mjs")],
        capture_output=True,
        text=True,
        timeout=120.0 * PACE,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    account: dict[str, Any] = json.loads(ran.stdout)
    return account


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


@pytest.mark.parametrize(("material", "phase"), TOUCHES)
def test_a_touch_is_heard_as_the_service_plans_it_for_controllers(
    material: str, phase: str
) -> None:
    asked = true_voice(material, phase)
    assert_is_the_true_voice(asked, heard_by_the_player(asked))


@pytest.mark.parametrize(("material", "phase"), TOUCHES)
@pytest.mark.parametrize("rate_hz", [44_100, 48_000])
def test_as_sound_it_is_the_sound_voice_of_the_service(
    material: str, phase: str, rate_hz: int
) -> None:
    asked = sound_voice(material, phase, rate_hz)
    assert_is_the_sound_voice(asked, heard_by_the_player(asked))


def heard_by_the_player(asked: dict[str, Any]) -> NDArray[np.float64]:
    require("node")
    ran = subprocess.run(
        ["node", str(HERE / "hear_feel.mjs"), str(FEEL)],
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        timeout=60.0 * PACE,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return np.array(json.loads(ran.stdout))
