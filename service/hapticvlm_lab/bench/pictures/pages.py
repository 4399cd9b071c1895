"""Pictures of the pages, in a real headless Chromium, while the demo's session runs."""

from __future__ import annotations

import asyncio
import re
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from hapticvlm.captures import read
from hapticvlm.client import connect
from hapticvlm.client.sending import stream
from hapticvlm.commands.demo.run import CAPTURE
from hapticvlm.commands.local_service import running
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
        page.goto(f"{service.page}scene/webxr/")
        expect(page.locator("#state")).to_contain_text("Connected")
        page.evaluate(PRESS, "kettle")
        page.wait_for_timeout(HELD_MS)
        page.screenshot(path=str(picture))


async def _touch(url: str) -> None:
    async with connect(url, name="demo scene") as client:
        await stream(client, read(CAPTURE), seen=lambda *_: None)


@contextmanager
def _page() -> Iterator[Page]:
    """Open an empty page. Raises UsageError without a browser."""
    chromium = shutil.which("chromium")
    if chromium is None:
        raise UsageError("no chromium: apt-get install chromium libegl1 libgl1-mesa-dri")
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(PATIENCE_MS)
        try:
            yield page
        finally:
            browser.close()
