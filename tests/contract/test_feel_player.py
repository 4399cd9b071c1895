"""The JavaScript player of `feel.json` beside the service: the same touches, the same vibration."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from feel_parity import GOLDEN, Deviation, deviations
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
