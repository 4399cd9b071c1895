"""What the dashboard keeps and finds again: recorded sessions, and what a person stated."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from dashboard_scene import AXE, PATIENCE_MS, chromium, dashboard, missing, touching
from playwright.sync_api import Browser, Page, expect
from recorded_session import record

from hapticvlm.client.local_service import running
from hapticvlm.server.web.recorded_sessions import MAKE_S

pytestmark = pytest.mark.browser

HOSTILE = "<img src=x onerror=alert(1)> #t=1?c%2e"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if reason := missing():
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    expect.set_options(timeout=PATIENCE_MS)
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two sessions, one of a name that tries to be a page."""
    root = tmp_path_factory.mktemp("sessions")
    session = record(root)
    shutil.copytree(session, session.with_name(HOSTILE))
    return root


def test_a_recorded_session_is_a_click_away_and_links_to_its_moments(
    folder: Path, browser: Browser
) -> None:
    with running(["--record", str(folder)]) as service, dashboard(browser, service.page) as page:
        page.get_by_role("button", name="Recorded").click()
        expect(page.locator("#sessions-title")).to_be_focused()
        expect(page.locator("#sessions a")).to_have_count(2)
        assert page.locator("#sessions img").count() == 0
        with page.context.expect_page() as opened:
            page.get_by_role("link", name=HOSTILE).click()
        session = opened.value
        expect(session.locator("#clock")).to_contain_text(" of ", timeout=MAKE_S * 1000)
        session.locator("#scrubber").fill("1.0")
        expect(session.locator("#name")).to_have_text("TeaMug_01")
        session.locator("#link").click()
        assert session.url.endswith("#t=1.00")
        session.goto(session.url)
        session.reload()
        expect(session.locator("#clock")).to_contain_text("1.00 of")
        page.evaluate(AXE.read_text(encoding="utf-8"))
        assert page.evaluate("async () => (await axe.run()).violations.map((v) => v.id)") == []


def test_without_a_recording_folder_nothing_of_it_is_shown(browser: Browser) -> None:
    with running() as service, dashboard(browser, service.page) as page:
        expect(page.locator("#owner")).to_contain_text("Nobody")
        expect(page.locator("#sessions-open")).to_be_hidden()
        expect(page.locator("#sessions-card")).to_be_hidden()


def say(page: Page, material: str) -> None:
    page.get_by_role("button", name="Object_07").click()
    page.locator("#teach-material").select_option(material)
    page.get_by_role("button", name="Correct it").click()
    expect(page.locator("#teach-told")).to_contain_text(f"Taken: {material}")


def test_what_a_person_stated_is_saved_and_is_known_to_the_next_run(
    browser: Browser, tmp_path: Path
) -> None:
    saved, token = tmp_path / "stated.json", ["--token", "a token of a dozen"]
    address = "#token=a%20token%20of%20a%20dozen"
    with (
        running(token) as service,
        touching(service.url, only="thing", token=token[1]),
        dashboard(browser, service.page + address) as page,
    ):
        say(page, "glass")
        with page.expect_download() as downloading:
            page.get_by_role("button", name="Save").click()
        downloading.value.save_as(saved)
        expect(page.locator("#teach-told")).to_contain_text("--stated stated.json")
    with (
        running(["--stated", str(saved)]) as service,
        touching(service.url, only="thing"),
        dashboard(browser, service.page) as page,
    ):
        expect(page.locator("#material")).to_have_text("glass")
        expect(page.locator("#verdict")).to_contain_text("the scene says so")
        say(page, "fabric")  # a person may think again
        expect(page.locator("#material")).to_have_text("fabric")
