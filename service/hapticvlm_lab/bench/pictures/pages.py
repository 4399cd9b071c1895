"""Pictures of the pages, taken in a real headless Chromium while the demo's session runs."""

from __future__ import annotations

import asyncio
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from hapticvlm.captures import read
from hapticvlm.client import connect
from hapticvlm.client.local_service import running
from hapticvlm.client.sending import stream
from hapticvlm.demo import CAPTURE
from hapticvlm.errors import UsageError

ROOT = Path(__file__).parents[4]
SIZE = (1280, 800)  # px of a small laptop
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")
PATIENCE_MS = 120_000  # a scene is drawn on a processor
HELD = re.compile("Kettle")  # the object that the demo holds for four seconds
HELD_MS = 3_000  # then plate and speaker show what they do
PRESS = """async (key) => {
  const main = await import('./main.js');
  const three = await import('three');
  const canvas = document.getElementById('view');
  const {root} = main.objects.find((object) => object.key === key);
  const at = new three.Box3().setFromObject(root).getCenter(new three.Vector3());
  at.project(main.camera);
  const where = {
    clientX: (at.x + 1) / 2 * canvas.clientWidth,
    clientY: (1 - at.y) / 2 * canvas.clientHeight,
    pointerId: 1, bubbles: true,
  };
  for (const type of ['pointermove', 'pointerdown']) {
    canvas.dispatchEvent(new PointerEvent(type, where));
    await new Promise((done) => setTimeout(done, 300));
  }
}"""


def dashboard(_: Path, picture: Path) -> None:
    """Write the dashboard's first screen while a steel kettle is held."""
    with running() as service, _page() as page, ThreadPoolExecutor(1, "scene") as threads:
        page.goto(service.page)
        expect(page.locator("#link")).to_contain_text("Connected to")
        scene = threads.submit(lambda: asyncio.run(_touch(service.url)))
        expect(page.locator("#object")).to_contain_text(HELD)
        page.wait_for_timeout(HELD_MS)
        page.screenshot(path=str(picture))
        scene.result()


def webxr(_: Path, picture: Path) -> None:
    """Write the WebXR scene while its kettle is touched with the mouse."""
    with running(["--scene", str(ROOT / "examples")]) as service, _page() as page:
        page.goto(f"{service.page}scene/webxr/?quality=full")
        expect(page.locator("#state")).to_contain_text("Connected")
        page.evaluate(PRESS, "kettle")
        page.wait_for_timeout(HELD_MS)
        page.screenshot(path=str(picture))


def feel_this(_: Path, picture: Path) -> None:
    """Write the page `/try` while the kettle of its first picture is stroked."""
    with running() as service, _page() as page:
        page.goto(f"{service.page}try")
        expect(page.locator("#pane")).to_have_attribute("data-looked", "1")  # it is recognised
        canvas = page.locator("#picture").bounding_box()
        assert canvas is not None
        x, y = canvas["x"] + 0.4 * canvas["width"], canvas["y"] + 0.4 * canvas["height"]
        page.mouse.move(x, y)  # a hand of its own ends the one that the page shows
        expect(page.locator("#material")).to_have_text("metal")
        page.mouse.down()
        for step in range(20):
            page.mouse.move(x + 2 * step, y)
            page.wait_for_timeout(20)
        page.screenshot(path=str(picture))


def study(folder: Path, picture: Path) -> None:
    """Write the participant's page while a pattern is rendered in training."""
    with _studied(folder) as address, _page() as page:
        _train(page, address)
        page.screenshot(path=str(picture))


def experimenter(folder: Path, picture: Path) -> None:
    """Write the experimenter's page at the same moment."""
    with _studied(folder) as address, _page() as page:
        browser = page.context.browser
        assert browser is not None
        desk = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        desk.goto(address.replace("study.html", "experimenter.html"))
        _train(page, address)
        expect(desk.locator("#now")).to_contain_text("playing in training")
        desk.screenshot(path=str(picture))


@contextmanager
def _studied(folder: Path) -> Iterator[str]:
    """Run a new study on simulated devices; yields the address of its page."""
    program = (sys.executable, "-m", "hapticvlm", "study")
    subprocess.run([*program, "new", str(folder)], check=True)
    with subprocess.Popen(
        [*program, "run", str(folder), "--port", "0"], stdout=subprocess.PIPE, text=True
    ) as study:
        try:
            assert study.stdout is not None
            yield study.stdout.readline().split()[-1]
        finally:
            study.terminate()


def _train(page: Page, address: str) -> None:
    """Take part until the first pattern is rendered."""
    page.goto(address)
    page.locator("[data-participant=P01]").click()
    page.locator(".agree input").check()
    page.locator("#form button").click()
    page.locator("input[name=age]").wait_for()
    page.locator("#form button").click()
    page.locator("#go:enabled").click()
    page.wait_for_timeout(HELD_MS)


async def _touch(url: str) -> None:
    async with connect(url, name="demo scene") as client:
        await stream(client, read(CAPTURE), seen=lambda *_: None)


@contextmanager
def _page() -> Iterator[Page]:
    """Open an empty page. Raises UsageError without a browser."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise UsageError("Chromium is missing: apt-get install chromium libegl1 libgl1-mesa-dri")
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(PATIENCE_MS)
        try:
            yield page
        finally:
            browser.close()
