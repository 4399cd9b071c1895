"""The pages on a phone: words are whole, none lies over another, and no keys are named."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from dashboard_scene import AXE, PATIENCE_MS, touching
from phone import OPEN_ALL, PHONE, complaints
from playwright.sync_api import Browser, Page, expect
from recorded_session import record
from webxr_scene import EXAMPLES, SLOW_MS

from hapticvlm.client.local_service import Service, running
from hapticvlm.commands.main import main

pytestmark = [pytest.mark.browser, pytest.mark.nightly]
# The card beside the finger lies off the picture.
APART = """() => {
  const [card, picture] = ["card", "picture"].map(
    (id) => document.getElementById(id).getBoundingClientRect());
  return card.height > 0 && (card.top >= picture.bottom || card.bottom <= picture.top);
}"""


@contextmanager
def phone(browser: Browser, address: str) -> Iterator[Page]:
    context = browser.new_context(
        viewport=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce"
    )
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(address)
    if page.locator("#link[role=status]").count():
        expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    try:
        yield page
    finally:
        context.close()


def check(page: Page, state: str) -> None:
    assert complaints(page) == [], state


def clean(page: Page) -> None:
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [violation["id"] for violation in found] == []


def test_try_fits_a_phone_in_every_state_with_picture_and_answer_together(
    browser: Browser, service: Service
) -> None:
    with phone(browser, f"{service.page}try") as page:
        expect(page.locator("#pane")).to_have_attribute("data-looked", "1")
        check(page, "before a touch")
        for part in ("#picture", "#material", "#stop"):
            expect(page.locator(part)).to_be_in_viewport(ratio=1)
        stop = page.locator("#stop").bounding_box()
        assert stop is not None
        assert stop["height"] < 50  # a slim bar
        assert stop["y"] > 0.9 * PHONE["height"]
        page.locator("#picture").tap()
        expect(page.locator("#feels")).to_contain_text("knocks")
        expect(page.locator("#feels")).to_be_in_viewport(ratio=1)
        assert page.evaluate(APART)
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


def test_the_page_of_a_session_fits_a_phone(browser: Browser, tmp_path: Path) -> None:
    folder = record(tmp_path)
    assert main(["replay", str(folder), "--view"]) == 0
    with phone(browser, (folder / "session.html").as_uri()) as page:
        for time_s in ("0.2", "1.0"):
            page.locator("#scrubber").fill(time_s)
            check(page, f"at {time_s} s")
        page.locator("#save").tap()
        expect(page.locator("#copied")).to_contain_text("Saved")
        check(page, "saved")
        clean(page)


def test_the_gallery_of_touches_fits_a_phone(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "metal.html"
    command = ["feel", "metal", "--seconds", "0.6", "--save", str(file)]
    assert main(command) == 0
    with phone(browser, file.as_uri()) as page:
        check(page, "closed")
        page.evaluate(OPEN_ALL)
        check(page, "all opened")
        page.get_by_role("button", name="everything of metal, carve").tap()
        expect(page.locator("#told")).to_contain_text("Saved")
        check(page, "saved")
        clean(page)


@pytest.mark.needs_toolchain("chromium", "three")
def test_the_webxr_scene_fits_a_phone(browser: Browser) -> None:
    with (
        running(["--scene", str(EXAMPLES)]) as service,
        phone(browser, f"{service.page}scene/webxr/") as page,
    ):
        page.locator("#state", has_text="plate").wait_for(timeout=SLOW_MS)
        check(page, "at rest")
        page.locator("#why-button").tap()
        expect(page.locator("#drawer")).to_be_visible()
        check(page, "details")
