"""The page /try in a browser: opens it, points at its picture, gives it another one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dashboard_scene import PATIENCE_MS, WATCH_POLICY
from playwright.sync_api import Browser, Page, ViewportSize, expect

import hapticvlm
from hapticvlm.client.local_service import Service

PAGES = Path(hapticvlm.__file__).parent / "pages"

# The drawn hand stays for three seconds, which a slow machine needs to open the page.
SLOWED = "const now = performance.now.bind(performance); performance.now = () => now() / %d;"
DROP = """([name, data]) => {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name, {type: "image/png"}));
  for (const type of ["dragover", "drop"]) {
    document.getElementById("stage").dispatchEvent(
      new DragEvent(type, {dataTransfer: transfer, bubbles: true, cancelable: true}));
  }
}"""


@contextmanager
def visit(
    browser: Browser,
    where: Service | str,
    size: tuple[int, int] = (1280, 900),
    hash_: str = "",
    slowed: int = 1,
    **options: Any,
) -> Iterator[Page]:
    """Open the page, of a service or at an address; by default no drawn hand touches its picture.

    Its clock is `slowed` so many times.
    """
    viewport = ViewportSize(width=size[0], height=size[1])
    context = browser.new_context(viewport=viewport, **{"reduced_motion": "reduce"} | options)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.add_init_script(WATCH_POLICY)
    page.add_init_script(SLOWED % slowed)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((where if isinstance(where, str) else f"{where.page}try") + hash_)
    try:
        expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
        yield page
        assert errors == []
        assert page.evaluate("window.violations") == []
    finally:
        context.close()


def at(page: Page, x: float, y: float, steps: int = 4) -> None:
    box = page.locator("#picture").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"], steps=steps)


def sample(page: Page, name: str = "table") -> None:
    """Open the picture of a sample as one of the user's own, which has no labels."""
    with next_picture(page):
        page.locator("#file").set_input_files(str(PAGES / f"try.{name}.jpg"))


@contextmanager
def next_picture(page: Page) -> Iterator[None]:
    """Wait until the picture that is given here is shown, and recognised as a whole, too."""
    pane = page.locator("#pane")
    expect(pane).to_have_attribute("data-picture", re.compile(r"\d"))
    before = str(pane.get_attribute("data-picture"))
    yield
    expect(pane).not_to_have_attribute("data-picture", before)
    expect(pane).to_have_attribute("data-looked", str(pane.get_attribute("data-picture")))
