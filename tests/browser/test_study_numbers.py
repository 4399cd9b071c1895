"""Numbers as participants type them, with a comma or a point, in a real Chromium."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from dashboard_scene import PATIENCE_MS
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.nightly, pytest.mark.browser]

STUDY = """
languages = ["de"]
participants = 2
patterns = "ours"
consent.de = "ok?"
[[question]]
name = "weight"
kind = "number"
text.de = "Gewicht in kg?"
[[question]]
name = "age"
kind = "number"
low = 18
high = 99.5
text.de = "Alter?"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


@pytest.fixture(params=["en-US", "de-DE"])
def page(request: pytest.FixtureRequest, browser: Browser, folder: Path) -> Iterator[Page]:
    """The questions of the study, in a browser of either language."""
    command = [sys.executable, "-m", "hapticvlm", "study", "run", str(folder), "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    context = browser.new_context(locale=request.param)
    context.set_default_timeout(PATIENCE_MS)
    try:
        assert process.stdout is not None
        page = context.new_page()
        page.goto(process.stdout.readline().split()[-1])
        page.locator("[data-participant=P01]").click()
        page.locator("input[name=agreed]").check()
        page.locator("#form button").click()
        page.locator("input[name=weight]").wait_for()
        yield page
    finally:
        context.close()
        process.terminate()
        process.communicate(timeout=PATIENCE_MS / 1000)


def typed(page: Page, name: str, keys: str) -> None:
    page.locator(f"input[name={name}]").fill("")
    page.locator(f"input[name={name}]").press_sequentially(keys)


def is_accepted(page: Page, name: str) -> bool:
    return bool(page.locator(f"input[name={name}]").evaluate("input => input.validity.valid"))


def test_a_decimal_comma_is_kept_as_it_was_meant(page: Page, folder: Path) -> None:
    understood = page.locator("label:has(input[name=weight]) output")
    for keys in ("70,5", "70.5", " +70,50 "):
        typed(page, "weight", keys)
        expect(understood).to_have_text("= 70,5")
    for keys in ("1.234,5", "1,234.5", "70,5 kg", "7o", "1e3", ",", "9999999999999"):
        typed(page, "weight", keys)
        assert not is_accepted(page, "weight"), keys
        expect(understood).to_have_text("")
    for keys, fits in (("17,9", False), ("18", True), ("99,5", True), ("99,6", False), ("", True)):
        typed(page, "age", keys)
        assert is_accepted(page, "age") is fits, keys
    typed(page, "weight", "70,5")
    page.locator("#form button").click()
    page.locator("#go").wait_for()
    lines = (folder / "P01.jsonl").read_text(encoding="utf-8").splitlines()
    answers = [event["answers"] for event in map(json.loads, lines) if event["event"] == "told"]
    assert answers == [{"weight": 70.5, "age": None}]
