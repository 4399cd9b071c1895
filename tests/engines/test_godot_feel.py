"""The GDScript player of `feel.json` in a real engine beside the service: the same vibration."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest
from feel_parity import GOLDEN, deviations
from godot_pack import pack, project_files
from godot_scene import CHROMIUM, ENGINE, LLVMPIPE, PATIENCE_S, PROJECT, TEMPLATE
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


def test_it_plans_every_golden_touch_as_the_service_does() -> None:
    table = deviations(GOLDEN, played(GOLDEN))
    assert [each for each in table if not each.is_small] == []


def played(cases: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the cases with the plans of the GDScript player, in Godot in Chromium."""
    said: list[dict[str, Any]] = []
    complaints: list[str] = []
    with (
        tempfile.TemporaryDirectory(dir=TEMPLATE.parents[1], prefix="feel-") as folder,
        served(exported(Path(folder), cases)) as address,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(
            executable_path=shutil.which(CHROMIUM), args=["--no-sandbox", *LLVMPIPE]
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
    print("one plan takes", said[-1]["detail"]["plan_us"], "us")
    assert complaints == [], complaints[:6]
    return [each["detail"] for each in said if each["what"] == "case"]


def exported(folder: Path, cases: list[dict[str, Any]]) -> Path:
    """Put the engine, a page and a project with the player and these cases into a folder."""
    project = folder / "project"
    project.mkdir()
    for script in (*sorted(ADDON.glob("feel_*.gd")), HERE / "play_feel.gd"):
        shutil.copy(script, project)
    (project / "project.godot").write_text(SETTINGS)
    (project / "play.tscn").write_text(SCENE)
    files = project_files(project)
    files["feel.json"] = (ADDON / "feel.json").read_bytes()
    files["cases.json"] = json.dumps(cases).encode()
    for name in ENGINE:
        os.link(TEMPLATE / name, folder / name)
    shutil.copy(HERE / "godot_page.html", folder / "index.html")
    (folder / "index.pck").write_bytes(pack(files))
    return folder
