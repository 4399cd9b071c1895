"""A page that `vite build` makes with the web package hears a touch, as one from source does."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from pace import PACE
from static_server import served
from toolchains import require

pytestmark = [pytest.mark.nightly, pytest.mark.browser, pytest.mark.needs_toolchain("chromium")]

ROOT = Path(__file__).parents[2]
MODULES = ROOT / "tests" / "contract" / "node_modules"
PACKAGE = ROOT / "examples" / "webxr" / "client"
HEARD_S = 10.0 * PACE
PAGE = '<!doctype html><button>Start</button><script type="module" src="./main.js"></script>'
# Touches until something is heard, because a busy machine may start its sound late.
MAIN = """
import {Felt, FeltSound, openFeel} from 'hapticvlm';
import file from 'hapticvlm/feel.sound.json';
document.querySelector('button').onclick = async () => {
  const context = new AudioContext();
  const feel = openFeel(file);
  const felt = new Felt(null, feel);
  const fail = (error) => (window.problem = `${error}`);
  const sound = await FeltSound.open(context, feel).catch(fail);
  const ear = new AnalyserNode(context);
  sound.output.connect(ear).connect(context.destination);
  const wave = new Float32Array(ear.fftSize);
  const touch = {hand: 'right', speed_mps: 0.8, force_n: 2};
  setInterval(() => {
    for (const phase of ['release', 'contact']) sound.touch({...touch, phase}, {material: 'glass'});
  }, 250);
  setInterval(() => {
    ear.getFloatTimeDomainData(wave);
    window.loudest = Math.max(window.loudest ?? 0, ...wave.map(Math.abs));
  }, 20);
};
"""


@pytest.mark.parametrize("inlined", [0, 1 << 20])
def test_a_bundled_page_hears_a_touch(browser: Any, tmp_path: Path, inlined: int) -> None:
    require("node")
    modules = tmp_path / "node_modules"
    shutil.copytree(PACKAGE, modules / "hapticvlm")
    shutil.copytree(MODULES / "@msgpack", modules / "@msgpack")
    (tmp_path / "index.html").write_text(PAGE)
    (tmp_path / "main.js").write_text(MAIN)
    settings = {"base": "./", "build": {"assetsInlineLimit": inlined}}
    (tmp_path / "vite.config.mjs").write_text(f"export default {json.dumps(settings)};")
    vite = MODULES / "vite" / "bin" / "vite.js"
    built = subprocess.run(
        ["node", str(vite), "build"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120.0 * PACE,
        check=False,
    )
    assert built.returncode == 0, built.stderr
    shutil.move(tmp_path / "dist", tmp_path / "site" / "below")
    with served(tmp_path / "site") as root:
        page = browser.new_page()
        page.goto(f"{root}below/")
        page.click("button")
        page.wait_for_function(
            "() => window.problem || window.loudest > 0.01", timeout=1000.0 * HEARD_S
        )
        assert page.evaluate("() => window.problem") is None
        page.close()
