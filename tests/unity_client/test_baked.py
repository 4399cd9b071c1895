"""The C# player of `feel.json` in Mono beside the service: the same touches, the same vibration."""

from __future__ import annotations

import json
from pathlib import Path

import mono
import pytest
from feel_parity import GOLDEN, deviations
from pace import PACE

pytest_plugins = ("mono_build",)
FEEL = mono.PACKAGE / "Runtime" / "Baked" / "Resources" / "HapticVLM" / "feel.json"


def test_it_plans_every_golden_touch_as_the_service_does(build: mono.Build) -> None:
    printed = build.run("baked.exe", str(FEEL), text=json.dumps(GOLDEN), timeout=120.0 * PACE)
    table = deviations(GOLDEN, json.loads(printed))
    assert [each for each in table if not each.is_small] == []


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
