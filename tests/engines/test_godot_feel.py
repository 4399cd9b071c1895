"""The GDScript player of `feel.json` in a real engine: the service's vibration, and its sound."""

from __future__ import annotations

import json
import os
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
from feel_parity import FITTED, GOLDEN, HOSTILE, REFUSED, assert_wrong_values_are_fitted, deviations
from godot_pack import pack, project_files
from godot_scene import CHROMIUM, ENGINE, LLVMPIPE, PATIENCE_S, PROJECT, TEMPLATE
from heard_parity import TOUCHES, assert_is_the_true_voice, true_voice
from numpy.typing import NDArray
from playwright.sync_api import sync_playwright
from static_server import served

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
LONGEST_PLAN_MS = 4.0  # a frame of a headset is 11 ms
LONGEST_SOUND_MS = 2.0  # of each frame
SOUND_HZ = 8000
FADED_S = 0.02
STROKES = ("stroke", "baked again", "touched again")


@dataclass(frozen=True)
class Played:
    """What the GDScript player planned for the golden cases, and how long each plan took."""

    cases: list[dict[str, Any]]
    plans_us: dict[str, list[float]]  # by interaction and form
    switched: dict[str, Any]  # what the motor was told while the service died and came back
    heard: list[NDArray[np.float64]]  # the samples of TOUCHES
    changed: dict[str, NDArray[np.float64]]  # of a stroke, half of them before the named change
    speaker: dict[str, Any]  # what a HapticSpeaker put out in each phase
    sounds_us: dict[str, list[float]]  # by interaction
    refused: list[str]  # what it told of touches that it does not take


@pytest.fixture(scope="module")
def gdscript() -> Played:
    """The golden cases in Godot in Chromium."""
    return played([*GOLDEN, *HOSTILE, *FITTED, *REFUSED])


def test_it_plans_every_golden_touch_as_the_service_does(gdscript: Played) -> None:
    table = deviations(GOLDEN, gdscript.cases[: len(GOLDEN)])
    assert [each for each in table if not each.is_small] == []


def test_a_wrong_value_is_taken_as_the_service_takes_it_and_a_wrong_word_is_not_felt(
    gdscript: Played,
) -> None:
    assert_wrong_values_are_fitted(gdscript.cases[len(GOLDEN) :])
    assert len(gdscript.refused) == len(REFUSED)  # once for each word


@pytest.mark.realtime
def test_a_plan_of_any_gesture_takes_a_third_of_a_frame(
    gdscript: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    plans = {kind: sorted(us) for kind, us in gdscript.plans_us.items()}
    medians = {kind: statistics.median(us) / 1000 for kind, us in plans.items()}
    with capsys.disabled():
        print("\nmedian ms of a plan:", {kind: round(ms, 1) for kind, ms in medians.items()})
    # Slower plans say how busy the machine is.
    quickest = {kind: us[len(us) // 10] / 1000 for kind, us in plans.items()}
    assert max(quickest.values()) <= LONGEST_PLAN_MS, quickest


def test_a_stroke_goes_on_while_the_service_dies_and_comes_back(gdscript: Played) -> None:
    for way in ("deaths", "freezes", "modes"):
        assert gdscript.switched[way]["gap_ms"] <= 50, way
        assert sorted(gdscript.switched[way]["by"]) == ["baked", "service"]


def test_a_strike_is_played_whatever_the_service_does(gdscript: Played) -> None:
    strikes = ("strike after a freeze", "strike after a death", "strike long after")
    amplitudes = [gdscript.switched[strike] for strike in strikes]
    assert amplitudes == [pytest.approx(amplitudes[2], rel=0.05)] * 3
    assert amplitudes[2] > 0.5


def test_nothing_is_felt_after_a_stop_though_the_other_one_takes_over(gdscript: Played) -> None:
    for case in ("stop with a service", "stop without one"):
        assert gdscript.switched[case]["held"] == 0
        assert gdscript.switched[case]["silence"] == "stopped: release and touch again"
        assert gdscript.switched[case]["again"] > 0.5


def test_the_mode_says_which_of_the_two_is_felt(gdscript: Played) -> None:
    assert gdscript.switched["auto, service"] == {"felt": True, "by": "service"}
    assert gdscript.switched["auto, none"] == {"felt": True, "by": "baked"}
    assert gdscript.switched["baked, service"] == {"felt": True, "by": "baked"}
    assert gdscript.switched["service, none"] == {"felt": False, "by": "service"}


@pytest.mark.parametrize("touch", range(len(TOUCHES)))
def test_a_touch_is_rendered_as_the_service_renders_it(gdscript: Played, touch: int) -> None:
    assert_is_the_true_voice(true_voice(*TOUCHES[touch]), gdscript.heard[touch])


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
        "no bake": "no feel.json: ",
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
def test_the_sound_of_any_gesture_takes_a_sixth_of_a_frame(
    gdscript: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        for kind, us in gdscript.sounds_us.items():
            median, slow = np.percentile(us, [50, 99]) / 1000
            print(f"\nms of a frame of sound, {kind}: median {median:.1f}, p99 {slow:.1f}", end="")
    medians = {kind: statistics.median(us) / 1000 for kind, us in gdscript.sounds_us.items()}
    assert max(medians.values()) <= LONGEST_SOUND_MS, medians


def test_a_strike_that_the_service_swallowed_is_heard_but_not_after_a_stop(
    gdscript: Played,
) -> None:
    assert gdscript.switched["heard with a service"] == ["contact"]
    assert gdscript.switched["heard after a freeze"] == ["contact", "release", "contact"]
    assert gdscript.switched["heard of a stop"] == ["contact", "stop"]


def test_a_thing_that_no_bake_knows_is_named(gdscript: Played) -> None:
    assert "`thing` is not in the bake" in gdscript.switched["unknown"]


def test_things_are_found_in_a_bake_as_the_shared_cases_say(gdscript: Played) -> None:
    assert identity.differences(gdscript.switched["identity"]) == []


def test_a_surface_is_felt_as_decided_before_else_as_baked(gdscript: Played) -> None:
    largest_where_there_is_no_third = "wood"
    expected = ["wood", "metal", largest_where_there_is_no_third]
    assert gdscript.switched["materials"] == expected


def played(cases: list[dict[str, Any]]) -> Played:
    """Return the plans of the GDScript player for these cases, in Godot in Chromium."""
    said: list[dict[str, Any]] = []
    complaints: list[str] = []
    with (
        tempfile.TemporaryDirectory(dir=TEMPLATE.parents[1], prefix="feel-") as folder,
        served(exported(Path(folder), cases)) as address,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(
            executable_path=shutil.which(CHROMIUM), args=["--no-sandbox", *LLVMPIPE, *AUDIBLE]
        )
        page = browser.new_page()

        def hear(message: Any) -> None:
            if message.text.startswith("PROBE "):
                said.append(json.loads(message.text.removeprefix("PROBE ")))
            elif message.type == "error":
                complaints.append(message.text)

        page.on("console", hear)
        page.goto(address)
        end = time.monotonic() + 2 * PATIENCE_S
        while not (said and said[-1]["what"] == "done"):
            assert time.monotonic() < end, f"{len(said)} cases; {complaints[-5:]}"
            page.wait_for_timeout(100)
        browser.close()
    refused = [text for text in complaints if "a touch is not felt" in text]
    others = [text for text in complaints if "a touch is not felt" not in text]
    assert [text for text in others if "at: push_warning" not in text] == []
    details: dict[str, list[dict[str, Any]]] = {}
    for each in said:
        details.setdefault(each["what"], []).append(each["detail"])
    [done] = details["done"]
    return Played(
        cases=details["case"],
        plans_us=done["plans_us"],
        switched={name: told for one in details["switch"] for name, told in one.items()},
        heard=[np.array(one["wave"]) for one in details["heard"]],
        changed={one["name"]: np.array(one["wave"]) for one in details["change"]},
        speaker=details["speaker"][0],
        sounds_us=done["sounds_us"],
        refused=refused,
    )


def exported(folder: Path, cases: list[dict[str, Any]]) -> Path:
    """Put the engine, a page and a project with the player and these cases into a folder."""
    project = folder / "project"
    project.mkdir()
    shutil.copytree(ADDON, project / "addons" / "hapticvlm")
    for script in ("play_feel.gd", "switch_feel.gd", "hear_feel.gd"):
        shutil.copy(HERE / script, project)
    (project / "project.godot").write_text(SETTINGS)
    (project / "play.tscn").write_text(SCENE)
    files = project_files(project)
    files["addons/hapticvlm/feel.json"] = (ADDON / "feel.json").read_bytes()
    asked = [true_voice(*touch) for touch in TOUCHES]
    files["heard.json"] = json.dumps(asked).encode()
    files["identity_cases.json"] = identity.FILE.read_bytes()
    files["cases.json"] = json.dumps(cases).encode()
    for name in ENGINE:
        os.link(TEMPLATE / name, folder / name)
    shutil.copy(HERE / "godot_page.html", folder / "index.html")
    (folder / "index.pck").write_bytes(pack(files))
    return folder
