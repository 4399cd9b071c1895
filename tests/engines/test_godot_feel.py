"""The GDScript player of a feel file in a real engine: its golden vectors, and its sound."""

from __future__ import annotations

import base64
import json
import re
import shutil
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import identity
import numpy as np
import pytest
import switch_cases
from godot_pack import TEMPLATE, project_files, write_game
from godot_scene import PATIENCE_S, PROJECT
from headless import LLVMPIPE, chromium
from numpy.typing import NDArray
from static_server import served

import player_vectors
from hapticvlm.rendering.vibration.vibration import INTERACTIONS

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.browser,
    pytest.mark.needs_toolchain("chromium", "godot"),
]

HERE = Path(__file__).parent
ADDON = PROJECT / "addons" / "hapticvlm"
SETTINGS = """config_version=5
[application]
run/main_scene="res://play.tscn"
[rendering]
renderer/rendering_method="gl_compatibility"
"""
SCENE = """[gd_scene load_steps=2 format=3]
[ext_resource type="Script" path="res://play_feel.gd" id="1"]
[node name="Play" type="Node"]
script = ExtResource("1")
"""


AUDIBLE = ("--autoplay-policy=no-user-gesture-required",)  # else a page is silent until a click
LONGEST_SOUND_MS = 1.0  # of each 10 ms
SOUND_HZ = 8000
FADED_S = 0.02
STROKES = ("stroke", "baked again", "touched again")
PLANS, SOUNDS, HOSTILE = (
    json.loads((PROJECT.parents[1] / "schemas" / "vectors" / f"{name}.json").read_text())
    for name in ("player", "player_sound", "player_hostile")
)
SOUNDS = [case for case in SOUNDS if case["voice"] == "true"]
GRID = player_vectors.grid()
CASES = {"plans": PLANS, "sounds": SOUNDS, **HOSTILE, "touches": HOSTILE["touches"] + GRID}


@dataclass(frozen=True)
class Played:
    """What the GDScript player made of the cases, in their order, and how long it took."""

    answers: dict[str, list[Any]]
    plans_us: dict[str, list[float]]  # by interaction and form
    floor_us: list[float]  # of plain arithmetic, in turns with the plans
    opened_us: float
    switched: dict[str, Any]  # what the motor was told while the service died and came back
    changed: dict[str, NDArray[np.float64]]  # of a stroke, half of them before the named change
    damaged: list[Any]  # wrong values of each file that do harm, or are refused without their field
    speaker: dict[str, Any]  # what a HapticSpeaker put out in each phase


@pytest.fixture(scope="module")
def gdscript() -> Played:
    """The vectors in Godot in Chromium."""
    return played()


def test_it_plans_as_the_golden_vectors_say(gdscript: Played) -> None:
    pairs = zip(PLANS, gdscript.answers["plans"], strict=True)
    assert [each for pair in pairs for each in player_vectors.plan_problems(*pair)] == []


def test_it_renders_as_the_golden_vectors_say(gdscript: Played) -> None:
    texts = [answer["wave"] for answer in gdscript.answers["sounds"]]
    waves = [np.frombuffer(base64.b64decode(text), "<f4") for text in texts]
    pairs = zip(SOUNDS, waves, strict=True)
    assert [each for pair in pairs for each in player_vectors.problems(*pair)] == []


def test_a_hostile_touch_is_felt_as_the_one_that_the_service_would_feel(gdscript: Played) -> None:
    for case, (one, like) in zip(HOSTILE["touches"], gdscript.answers["touches"], strict=False):
        told, wanted = player_vectors.said(one["said"]), player_vectors.says(case)
        assert (case["name"], one["plan"], told) == (case["name"], like["plan"], wanted)


def test_no_touch_of_a_grid_gives_a_number_out_of_range(gdscript: Played) -> None:
    plans = [one["plan"] for one, _ in gdscript.answers["touches"][-len(GRID) :]]
    assert all(map(player_vectors.is_in_range, plans))
    assert sum(bool(plan["amplitude"]) for plan in plans) > len(GRID) / 2


def test_a_time_that_is_not_in_seconds_is_named(gdscript: Played) -> None:
    for case, answer in zip(HOSTILE["times"], gdscript.answers["times"], strict=True):
        assert player_vectors.said(answer["said"]) == player_vectors.says(case), case["name"]
        assert all(map(player_vectors.is_in_range, answer["plans"]))


def test_a_call_of_an_unknown_hand_or_form_is_refused_in_words(gdscript: Played) -> None:
    for case, answer in zip(HOSTILE["calls"], gdscript.answers["calls"], strict=True):
        assert (answer["is_held"], answer["plan"]["amplitude"]) == (False, [])
        assert player_vectors.said(answer["said"]) == player_vectors.says(case), case


def test_a_wrong_file_is_refused_with_its_field(gdscript: Played) -> None:
    pairs = zip(HOSTILE["files"], gdscript.answers["files"], strict=True)
    assert [(case, said) for case, said in pairs if not said.startswith(f"{case['field']}: ")] == []


@pytest.mark.realtime
def test_a_plan_of_any_gesture_takes_a_tenth_of_a_frame(
    gdscript: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    plans = {kind: sorted(us) for kind, us in gdscript.plans_us.items()}
    medians = {kind: statistics.median(us) / 1000 for kind, us in plans.items()}
    with capsys.disabled():
        print("\nmedian ms of a plan:", {kind: round(ms, 2) for kind, ms in medians.items()})
        print(f"ms to open the file: {gdscript.opened_us / 1000:.0f}")
    # Slower plans say how busy the machine is; on a slower one the floor takes longer, too.
    floor = sorted(gdscript.floor_us)[len(gdscript.floor_us) // 10] / 1000
    quickest = {kind: us[len(us) // 10] / 1000 for kind, us in plans.items()}
    assert max(quickest.values()) <= floor, (floor, quickest)


def test_the_switch_between_service_and_bake_does_as_the_scripts_say(gdscript: Played) -> None:
    told = {name: gdscript.switched[name] for name in switch_cases.CASES}
    assert switch_cases.problems(told, "sound", "because") == []


@pytest.mark.parametrize("change", ["stop", "mute", "release"])
def test_what_is_heard_of_a_stroke_fades_without_a_click(gdscript: Played, change: str) -> None:
    wave = gdscript.changed[change]
    begin = wave.size // 2
    stroke, fade = wave[:begin], wave[begin - 1 :]
    assert np.std(stroke) > 0.02
    assert np.abs(np.diff(fade)).max() <= np.abs(np.diff(stroke)).max()
    assert np.count_nonzero(fade[round(FADED_S * SOUND_HZ) :]) == 0


def test_a_speaker_is_heard_while_the_bake_is_felt_and_says_why_else(gdscript: Played) -> None:
    for phase in STROKES:
        assert gdscript.speaker[phase]["peak"] > 0.05, phase
        assert gdscript.speaker[phase]["silence"] == ""
    assert gdscript.speaker["released"]["peak"] == 0
    silent = {
        "no autoload": "the autoload HapticVLM is missing: enable the plugin",
        "no bake": "no feel.true.json: ",
        "service": "the service is felt, and plays on its own speaker",
        "stop": "stopped: release and touch again",
        "enabled after a stop": "stopped: release and touch again",
    }
    for phase, reason in silent.items():
        assert gdscript.speaker[phase]["peak"] == 0, phase
        assert gdscript.speaker[phase]["silence"].startswith(reason), phase


@pytest.mark.realtime
def test_a_speaker_plays_a_stroke_without_gaps(gdscript: Played) -> None:
    gaps = [
        gdscript.speaker[phase]["gap_ms"] for phase in ("stroke", "baked again", "touched again")
    ]
    assert min(gaps) == 0, gaps  # longer ones say how busy the machine is


@pytest.mark.realtime
def test_the_sound_of_any_gesture_takes_a_tenth_of_its_time(
    gdscript: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    pairs = [*zip(SOUNDS, gdscript.answers["sounds"], strict=True)]
    medians = {
        kind: statistics.median(own["us"] for case, own in pairs if kind in case["name"]) / 1000
        for kind in INTERACTIONS
    }
    with capsys.disabled():
        print(
            "\nmedian ms of 10 ms of sound:", {kind: round(ms, 2) for kind, ms in medians.items()}
        )
    assert max(medians.values()) <= LONGEST_SOUND_MS, medians


def test_a_strike_that_the_service_swallowed_is_heard_but_not_after_a_stop(
    gdscript: Played,
) -> None:
    assert gdscript.switched["heard with a service"] == ["contact"]
    assert gdscript.switched["heard after a freeze"] == ["contact", "release", "contact"]
    assert gdscript.switched["heard of a stop"] == ["contact", "stop"]


def test_a_thing_that_no_bake_knows_is_named(gdscript: Played) -> None:
    assert "`thing` is not in the bake" in gdscript.switched["unknown"]


def test_a_damaged_bake_is_named(gdscript: Played) -> None:
    said = gdscript.switched["damaged"]
    assert said == "materials.json: the file: is not of type object; bake it again"


def test_each_wrong_value_of_a_bake_is_refused_with_its_field_or_does_no_harm(
    gdscript: Played,
) -> None:
    assert gdscript.damaged == [[], []]


def test_things_are_found_in_a_bake_as_the_shared_cases_say(gdscript: Played) -> None:
    assert identity.differences(gdscript.switched["identity"]) == []


def test_a_surface_is_felt_as_decided_before_else_as_baked(gdscript: Played) -> None:
    largest_where_there_is_no_third = "wood"
    expected = ["wood", "metal", largest_where_there_is_no_third]
    assert gdscript.switched["materials"] == expected


def played() -> Played:
    """Return what the GDScript player makes of the cases, in Godot in Chromium."""
    said: list[dict[str, Any]] = []
    complaints: list[str] = []
    with (
        tempfile.TemporaryDirectory(dir=TEMPLATE.parents[1], prefix="feel-") as folder,
        served(exported(Path(folder))) as address,
        chromium(*LLVMPIPE, *AUDIBLE) as browser,
    ):
        page = browser.new_page()

        def hear(message: Any) -> None:
            if message.text.startswith("PROBE "):
                said.append(json.loads(message.text.removeprefix("PROBE ")))
            elif message.type == "error":
                complaints.append(message.text)

        page.on("console", hear)
        page.on("pageerror", lambda error: complaints.append(f"SCRIPT ERROR: {error}"))
        page.goto(address)
        end = time.monotonic() + 2 * PATIENCE_S
        while not (said and said[-1]["what"] == "done"):
            assert time.monotonic() < end, f"{len(said)} cases; {complaints[-5:]}"
            assert [text for text in complaints if "SCRIPT ERROR" in text] == []
            page.wait_for_timeout(100)
    # Of what is hostile; the engine itself says what is not base64.
    wanted = r"WARNING: HapticVLM: |ERROR: (HapticVLM: mat|.*b64_d)|   at: (push_|base64_to_raw)"
    assert [text for text in complaints if not re.match(wanted, text)] == []
    details: dict[str, list[Any]] = {}
    for each in said:
        details.setdefault(each["what"], []).append(each["detail"])
    [done] = details["done"]
    return Played(
        answers={what: details[what] for what in CASES},
        plans_us=done["plans_us"],
        floor_us=done["floor_us"],
        switched={name: told for one in details["switch"] for name, told in one.items()},
        changed={one["name"]: np.array(one["wave"]) for one in details["change"]},
        damaged=details["damaged"],
        speaker=details["speaker"][0],
        opened_us=done["opened_us"],
    )


def exported(folder: Path) -> Path:
    """Put the engine, a page and a project with the player and the cases into a folder."""
    project = folder / "project"
    project.mkdir()
    shutil.copytree(ADDON, project / "addons" / "hapticvlm")
    for script in ("play_feel.gd", "switch_feel.gd", "hear_feel.gd", "damage_feel.gd"):
        shutil.copy(HERE / script, project)
    (project / "project.godot").write_text(SETTINGS)
    (project / "play.tscn").write_text(SCENE)
    files = project_files(project)
    files["identity_cases.json"] = identity.FILE.read_bytes()
    files["cases.json"] = json.dumps({**CASES, "scripts": switch_cases.CASES}).encode()
    write_game(folder, files)
    return folder
