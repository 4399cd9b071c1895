"""The pages on a phone: words are whole, none lies over another, and no keys are named."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from dashboard_scene import AXE, PATIENCE_MS, touching
from playwright.sync_api import Browser, Page, ViewportSize, expect

from hapticvlm.client.local_service import Service, running

pytestmark = [pytest.mark.browser, pytest.mark.nightly]
PHONE = ViewportSize(width=390, height=844)
KEYS = re.compile(r"\b(Esc|Escape|wheel|Shift|keyboard|arrow keys|space bar)\b")

# The words that are broken across lines, and the pairs of words that lie over each other. What a
# reader does not see (clipped, hidden, for decoration) and the stop, which stays in front while the
# page scrolls, are left out.
WORDS = """() => {
  const words = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const parent = walk.currentNode.parentElement;
    const isLeftOut = parent.closest("#stop, .unseen, [aria-hidden=true], option, pre");
    if (isLeftOut || !parent.checkVisibility()) continue;
    if (getComputedStyle(parent).clipPath !== "none") continue;
    for (const { 0: word, index } of walk.currentNode.data.matchAll(/[\\p{L}\\p{N}]+/gu)) {
      const range = document.createRange();
      range.setStart(walk.currentNode, index);
      range.setEnd(walk.currentNode, index + word.length);
      const rects = [...range.getClientRects()].filter(({ width }) => width > 0);
      if (rects.length) words.push({ word, rects });
    }
  }
  const lines = ({ rects }) => new Set(rects.map(({ top }) => Math.round(top))).size;
  const broken = words.filter((one) => lines(one) > 1);
  const over = [];
  for (const [index, one] of words.entries()) {
    for (const other of words.slice(index + 1)) {
      const [a, b] = [one.rects[0], other.rects[0]];
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      const isOver = across > 1 && down > 0.4 * Math.min(a.height, b.height);
      if (isOver) over.push(`${one.word} / ${other.word}`);
    }
  }
  return { broken: broken.map(({ word }) => word), over };
}"""
OPEN_ALL = "() => document.querySelectorAll('details').forEach((one) => (one.open = true))"


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with running() as found:
        yield found


@contextmanager
def phone(browser: Browser, address: str) -> Iterator[Page]:
    context = browser.new_context(
        viewport=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce"
    )
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(address)
    expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    try:
        yield page
    finally:
        context.close()


def check(page: Page, state: str) -> None:
    seen: dict[str, Any] = page.evaluate(WORDS)
    assert seen == {"broken": [], "over": []}, state
    assert KEYS.findall(page.inner_text("body")) == [], state
    assert page.evaluate("document.scrollingElement.scrollWidth") <= PHONE["width"], state


def clean(page: Page) -> None:
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [violation["id"] for violation in found] == []


def test_try_fits_a_phone_in_every_state_with_picture_and_answer_together(
    browser: Browser, service: Service
) -> None:
    with phone(browser, f"{service.page}try") as page:
        expect(page.locator("#places .place").first).to_be_visible()
        expect(page.locator("#correct")).to_be_visible()
        check(page, "places")
        for part in ("#picture", "#material", "#stop"):
            expect(page.locator(part)).to_be_in_viewport(ratio=1)
        stop = page.locator("#stop").bounding_box()
        assert stop is not None
        assert stop["height"] < 50  # a slim bar
        assert stop["y"] > 0.9 * PHONE["height"]
        page.locator("#picture").tap()
        expect(page.locator("#object")).to_have_text("Under the hand")
        expect(page.locator("#feel-warmth")).to_be_in_viewport(ratio=1)
        check(page, "touched")
        page.evaluate(OPEN_ALL)
        check(page, "all opened")
        clean(page)


def test_the_dashboard_fits_a_phone_in_every_state(browser: Browser, service: Service) -> None:
    with phone(browser, service.page) as page:
        check(page, "at rest")
        with touching(service.url):
            expect(page.locator("#objects li")).to_have_count(4)
            check(page, "touched")
        page.evaluate("document.body.dataset.mode = 'idle'")
        page.evaluate(OPEN_ALL)
        check(page, "all opened")
        clean(page)
