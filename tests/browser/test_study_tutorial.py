"""The steps of docs/tutorials/study.md, each as it is printed, by a person at a Chromium."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from pace import PACE
from playwright.sync_api import Browser, Locator, Page, expect

pytestmark = [pytest.mark.browser, pytest.mark.nightly]

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorials" / "study.md"
STEP_MS = 120_000 * PACE
ANSWERED = 2


def printed() -> list[list[str]]:
    """Return the words of each command of the page."""
    lines = re.findall(r"^ *hapticvlm (.+)$", TUTORIAL.read_text(encoding="utf-8"), re.MULTILINE)
    return [line.split() for line in lines]


@contextmanager
def study(folder: Path, words: list[str]) -> Iterator[list[str]]:
    """Run the study; yield both links that it prints, and end it as the page says, by Ctrl-C."""
    command = [sys.executable, "-m", "hapticvlm", *words, "--port", "0"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            links: list[str] = []
            while len(links) < 2:
                line = process.stdout.readline()
                assert line, "it ended"
                links += re.findall(r"http://\S+", line)
            yield links
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60 * PACE)


def agree(page: Page) -> None:
    page.locator("[data-participant]").first.click()
    page.locator(".agree input").check()
    page.locator("#form button").click()
    page.locator("input[name=age]").fill("31")
    page.locator("#form button").click()


def reach(page: Page, wanted: Locator) -> None:
    """Wait for something; where a busy machine played too late to count, go on as the page asks."""
    trouble = page.locator("#alert:visible")
    while not wanted.is_visible():
        wanted.or_(trouble).first.wait_for()
        if trouble.is_visible() and not wanted.is_visible():
            page.locator("#go").click()
            trouble.wait_for(state="hidden")


def learn(page: Page) -> None:
    """Play the patterns with the space bar until the trials begin."""
    begin = page.locator("#go:enabled", has_text="Start the trials")
    while True:
        reach(page, page.locator(".pattern.next").or_(begin).first)
        if begin.is_visible():
            break
        page.keyboard.press("Space")
        page.wait_for_timeout(200)
    page.keyboard.press("Space")


def name_patterns(page: Page, first: int, count: int) -> None:
    for answered in range(first, first + count):
        reach(page, page.locator("#prompt", has_text="Which pattern was it?"))
        page.keyboard.press(str(answered))
        reach(page, page.locator("#form .scale").first)
        for scale in page.locator("#form .scale").all():
            scale.locator("input").first.check()
        page.locator("#form button").click()
        reach(page, page.locator(f"#progress[data-answered='{answered + 1}']"))


def test_the_pilot_is_written_run_learnt_answered_stopped_and_reported(
    browser: Browser, tmp_path: Path
) -> None:
    write, run, report = printed()
    here = [sys.executable, "-m", "hapticvlm"]
    subprocess.run([*here, *write], cwd=tmp_path, check=True)
    page = browser.new_page()
    page.set_default_timeout(STEP_MS)
    with study(tmp_path, run) as (participant, experimenter):
        page.goto(participant)
        agree(page)
        learn(page)
        name_patterns(page, 0, ANSWERED)
        desk = browser.new_page()
        desk.goto(experimenter)
        expect(desk.locator("#prompt")).to_contain_text("asked", timeout=STEP_MS)
        desk.close()
    with study(tmp_path, run) as (participant, _):  # goes on where it was stopped
        page.goto(participant)
        page.locator("[data-participant]").first.click()
        page.locator("#go", has_text="Continue").click()
        name_patterns(page, ANSWERED, 1)
    subprocess.run([*here, *report], cwd=tmp_path, check=True)
    (log,) = (tmp_path / "pilot").glob("P*.jsonl")
    events = [json.loads(line)["event"] for line in log.read_text().splitlines()]
    assert events.count("answered") == ANSWERED + 1
    page.goto((tmp_path / "pilot" / "report" / "report.html").as_uri())
    claims = page.locator("ul").first  # what may be claimed: nothing about people
    expect(claims).to_have_text("That the study runs: its page, its orders and this report.")
    page.close()
