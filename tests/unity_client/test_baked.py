"""The C# player of `feel.json` in Mono beside the service: the same touches, the same vibration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import identity
import mono
import numpy as np
import pytest
from feel_parity import FITTED, GOLDEN, HOSTILE, REFUSED, assert_wrong_values_are_fitted, deviations
from heard_parity import (
    TOUCHES,
    assert_is_the_sound_voice,
    assert_is_the_true_voice,
    sound_voice,
    true_voice,
)
from numpy.typing import NDArray
from pace import PACE

pytest_plugins = ("mono_build",)
FEEL = mono.PACKAGE / "Runtime" / "Baked" / "Resources" / "HapticVLM" / "feel.json"


def test_it_plans_every_golden_touch_as_the_service_does(build: mono.Build) -> None:
    printed = build.run("baked.exe", str(FEEL), text=json.dumps(GOLDEN), timeout=120.0 * PACE)
    table = deviations(GOLDEN, json.loads(printed))
    assert [each for each in table if not each.is_small] == []


def test_a_wrong_value_is_taken_as_the_service_takes_it_and_a_wrong_word_is_not_felt(
    build: mono.Build,
) -> None:
    cases = json.dumps([*HOSTILE, *FITTED, *REFUSED])
    assert_wrong_values_are_fitted(json.loads(build.run("baked.exe", str(FEEL), text=cases)))


def test_it_finds_things_in_a_bake_as_the_shared_cases_say(build: mono.Build) -> None:
    printed = build.run("baked.exe", str(identity.FILE), "identity", timeout=60.0 * PACE)
    assert identity.differences(json.loads(printed)) == []


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ('{"version": 2}', "version 2 is not 1"),
        ('{"version": 1}', "feel.json.rules"),
        ('{"version": 1', "not JSON"),
        ("[]", "not a map"),
    ],
)
def test_a_file_that_is_not_a_feel_is_refused_and_says_what_to_do(
    build: mono.Build, tmp_path: Path, content: str, named: str
) -> None:
    file = tmp_path / "feel.json"
    file.write_text(content)
    with pytest.raises(AssertionError) as failed:
        build.run("baked.exe", str(file), text="[]", timeout=60.0 * PACE)
    assert named in str(failed.value)
    assert "bake" in str(failed.value)


@pytest.mark.parametrize(("material", "phase"), TOUCHES)
def test_a_touch_is_heard_as_the_service_plans_it_for_controllers(
    build: mono.Build, material: str, phase: str
) -> None:
    asked = true_voice(material, phase)
    assert_is_the_true_voice(asked, heard(build, asked))


@pytest.mark.parametrize(("material", "phase"), TOUCHES)
@pytest.mark.parametrize("rate_hz", [44_100, 48_000])
def test_as_sound_it_is_the_sound_voice_of_the_service(
    build: mono.Build, material: str, phase: str, rate_hz: int
) -> None:
    asked = sound_voice(material, phase, rate_hz)
    assert_is_the_sound_voice(asked, heard(build, asked))


def heard(build: mono.Build, asked: dict[str, Any]) -> NDArray[np.float64]:
    """The samples of the C# player, as they come out of the ring of the audio thread."""
    text = json.dumps(asked)
    return np.array(
        json.loads(build.run("baked.exe", str(FEEL), "heard", text=text, timeout=60.0 * PACE))
    )
