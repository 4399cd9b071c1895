"""Checks the release workflow: code runs without write access, publishing jobs run no code of ours.

Every action is pinned by its commit.
"""

import re
import subprocess
from pathlib import Path
from typing import Any

import yaml

HOUSE = Path(__file__).parents[2]
WORKFLOWS = sorted((HOUSE / ".github" / "workflows").glob("*.yml"))
PINNED = re.compile(r"uses: [\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+$")
REFERENCES = HOUSE / "service" / "hapticvlm" / "vision" / "shipped" / "references"


def jobs() -> dict[str, dict[str, Any]]:
    declared: dict[str, dict[str, Any]] = yaml.safe_load(WORKFLOWS[0].read_text())["jobs"]
    return declared


def test_every_action_is_pinned_by_its_commit_with_its_version_beside_it() -> None:
    lines = [line.strip() for path in WORKFLOWS for line in path.read_text().splitlines()]
    used = [line.removeprefix("- ") for line in lines if "uses:" in line]
    assert len(used) >= 5
    assert [line for line in used if not PINNED.fullmatch(line)] == []


def test_the_job_that_runs_our_code_may_only_read() -> None:
    whole = yaml.safe_load(WORKFLOWS[0].read_text())
    assert whole["permissions"] == {"contents": "read"}
    assert "permissions" not in whole["jobs"]["build"]
    writing = {name: job["permissions"] for name, job in jobs().items() if "permissions" in job}
    told = {"id-token": "write"}  # who built it
    attested = {"contents": "write", "attestations": "write", **told}
    assert writing == {"release": attested, "index": told}


def test_what_publishes_runs_nothing_of_ours() -> None:
    for name in ("release", "index"):
        steps = jobs()[name]["steps"]
        commands = [step["run"].split()[0] for step in steps if "run" in step]
        assert set(commands) <= {"gh", "rm"}, name
        assert not any("checkout" in step.get("uses", "") for step in steps), name


def test_every_reference_picture_has_its_mask_and_the_sheet_says_whose_they_are() -> None:
    sheets = {path.stem for path in REFERENCES.glob("*.jpg")}
    masks = {path.name.removesuffix(".mask.png") for path in REFERENCES.glob("*.mask.png")}
    assert sheets == masks
    assert {path.suffix for path in REFERENCES.iterdir()} == {".jpg", ".png", ".md"}
    text = (REFERENCES / "SOURCES.md").read_text(encoding="utf-8")
    for licence in ("CC0-1.0", "MIT"):
        assert licence in text
    tracked = subprocess.run(
        ["git", "ls-files", "service"], cwd=HOUSE, check=True, capture_output=True, text=True
    ).stdout.split()
    pictures = {Path(name) for name in tracked if name.endswith((".jpg", ".png", ".webp"))}
    homes = (
        "hapticvlm/vision/shipped/references",
        "hapticvlm/demo/capture",
        "hapticvlm/pages/try.",
    )
    known = tuple(f"service/{home}" for home in homes)
    assert [path for path in pictures if not path.as_posix().startswith(known)] == []
    assert all(home.removeprefix("hapticvlm/") in text for home in homes[1:])
