"""A short study from consent to thanks, in German, heard and not felt, in a real Chromium.

Every state of both pages is looked at by axe-core: light on a screen, and dark on a phone.
"""

import json
import re
import subprocess
import sys
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pytest
from dashboard_scene import AXE, PATIENCE_MS
from pace import PACE
from phone import PHONE, complaints
from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize
from quick_patterns import quick_patterns

from hapticvlm_studio.design.form import TEMPLATE

pytestmark = [pytest.mark.nightly, pytest.mark.browser]

REMARK = "schön warm"
LOOKS: tuple[tuple[Literal["light", "dark"], ViewportSize], ...] = (
    ("dark", PHONE),
    ("light", ViewportSize(width=1280, height=800)),
)
SOUND = "import('./study.sound.js').then((module) => { window.sound = module.sound; })"
RECORD = """() => {
  const node = sound.output.context.createScriptProcessor(512, 1, 1);
  window.loudest = 0;
  node.onaudioprocess = ({ inputBuffer }) => {
    for (const each of inputBuffer.getChannelData(0)) loudest = Math.max(loudest, Math.abs(each));
  };
  sound.output.connect(node);
  node.connect(sound.output.context.destination);
  window.recorder = node;
}"""


# Keeps every name and size of the colour of warmth.
WARMTH = """() => {
  const box = document.getElementById('warmth');
  window.warmths = new Set();
  const note = () => box.hidden || warmths.add(`${box.ariaLabel} ${box.style.cssText}`);
  new MutationObserver(note).observe(box, {attributes: true});
}"""
# Answers with long names in the experimenter's table.
LONG_NAMES = """() => {
  const table = document.getElementById('recent');
  for (let at = 0; at < 3; at++) {
    const row = table.insertRow();
    for (const text of ['12', 'metal whooshing-cold', 'fabric rubbing-hot', '12.5'])
      row.insertCell().textContent = text;
  }
}"""


def study_file() -> str:
    """The file of a new study, cut short: four brief patterns, once each, without training."""
    text = TEMPLATE.read_text(encoding="utf-8")
    text = re.sub(r"^patterns = .*$", "", text, flags=re.M)
    for name, value in (("repeats", 1), ("renderings", 0), ("rest_s", 0.0), ("settle_c", 20)):
        text = re.sub(rf"^{name} = \S+", f"{name} = {value}", text, flags=re.M)
    return text + quick_patterns(0.6)


@dataclass
class Sat:
    """What both pages showed in each state, and what the participant's file holds."""

    found: dict[str, list[str]] = field(default_factory=dict)  # what axe-core complains of
    too_wide: dict[str, int] = field(default_factory=dict)  # px
    on_a_phone: dict[str, list[str]] = field(default_factory=dict)  # what `phone.py` complains of
    prompts: list[str] = field(default_factory=list)
    desk: str = ""
    warmths: list[str] = field(default_factory=list)  # of the pilot's colour, in the first trials
    loudest: float = 0.0
    faults: list[str] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)

    def look(self, state: str, page: Page) -> None:
        """Look at a page as it is on a screen and in the dark on a phone."""
        self.prompts.append(page.locator("#prompt").inner_text())
        for scheme, size in LOOKS:
            page.emulate_media(color_scheme=scheme)
            page.set_viewport_size(size)
            found = page.evaluate("axe.run()")["violations"]
            self.found[f"{state}, {scheme}"] = [each["id"] for each in found]
            wide = page.evaluate("document.scrollingElement.scrollWidth") - size["width"]
            self.too_wide[f"{state}, {scheme}"] = wide
            if size == PHONE:
                self.on_a_phone[state] = complaints(page)


@pytest.fixture(scope="module")
def sat(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Sat:
    folder = tmp_path_factory.mktemp("study")
    (folder / "study.toml").write_text(study_file(), encoding="utf-8")
    command = [sys.executable, "-m", "hapticvlm", "study", "run", str(folder), "--hear"]
    process = subprocess.Popen([*command, "--port", "0"], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    sat = Sat()
    context = browser.new_context()
    context.set_default_timeout(PATIENCE_MS)
    try:
        address = process.stdout.readline().split()[-1]
        take_part(sat, context, address)
    finally:
        context.close()
        process.terminate()
        process.wait(30 * PACE)
        process.stdout.close()
    lines = (folder / "P01.jsonl").read_text(encoding="utf-8").splitlines()
    sat.events = [json.loads(line) for line in lines]
    return sat


def take_part(sat: Sat, context: BrowserContext, address: str) -> None:
    page, desk = context.new_page(), context.new_page()
    for each, path in ((page, address), (desk, address.replace("study", "experimenter"))):
        each.on("pageerror", lambda error: sat.faults.append(str(error)))
        each.goto(path)
        each.evaluate(AXE.read_text(encoding="utf-8"))
    page.bring_to_front()
    page.locator("[data-participant=P01]").wait_for()
    sat.look("choosing", page)
    page.locator("[data-participant=P01]").click()
    page.locator("label[lang=de]").click()
    page.locator("#form button", has_text="Ich nehme teil").wait_for()
    sat.look("consent", page)
    assert "Platte" not in page.locator("main").aria_snapshot()  # read by ear: there is no plate
    page.locator(".agree input").check()
    page.locator("#form button").click()
    page.locator("input[name=age]").fill("31")
    sat.look("questions", page)
    page.locator("#form button").click()
    page.locator("#go", has_text="Durchgänge beginnen").wait_for()
    sat.look("training", page)
    page.locator("#go").click()
    page.locator("#hear-on:checked").wait_for()
    page.evaluate(SOUND)
    # A function, for the page's policy forbids what is evaluated anew at each look; and never a
    # promise, which is true before it is kept.
    page.wait_for_function("() => sound.isOn")
    page.evaluate(RECORD)
    page.evaluate(WARMTH)
    for trial in range(4):
        page.locator(".pattern:enabled").first.wait_for()
        if trial == 0:
            sat.look("asking", page)
            sat.look("experimenter", desk)
            sat.desk = desk.locator("#now").inner_text()
        page.locator(".pattern").nth(trial).click()
        page.locator("#form .scale").first.wait_for()
        if trial == 0:
            sat.look("rating", page)
        for name, value in (("real", 5), ("pleasant", 3)):
            page.locator(f"input[name={name}][value='{value}']").check()
        page.locator("#form button").click()
    page.locator("textarea").fill(REMARK)
    sat.look("remarks", page)
    sat.loudest = page.evaluate("loudest")
    sat.warmths = page.evaluate("[...warmths]")
    page.locator("#form button").click()
    page.locator("#prompt", has_text="Vielen Dank").wait_for()
    sat.look("done", page)
    desk.locator("#prompt", has_text="All done").wait_for()
    sat.look("experimenter, done", desk)
    desk.evaluate(LONG_NAMES)
    desk.set_viewport_size(PHONE)
    sat.on_a_phone["experimenter, long names"] = complaints(desk)


def test_axe_finds_nothing_in_any_state_of_either_page(sat: Sat) -> None:
    assert {state: ids for state, ids in sat.found.items() if ids} == {}
    assert len(sat.found) == 20
    assert sat.faults == []


def test_every_state_fits_a_phone(sat: Sat) -> None:
    assert {state: what for state, what in sat.on_a_phone.items() if what} == {}
    assert len(sat.on_a_phone) == 11


def test_no_state_scrolls_sideways(sat: Sat) -> None:
    assert {state: wide for state, wide in sat.too_wide.items() if wide > 0} == {}


def test_after_the_choice_the_page_speaks_german(sat: Sat) -> None:
    participant = [text for text in sat.prompts if "asked" not in text and "All" not in text]
    assert participant == ["Who takes part?", "Willkommen", "Einige Fragen",
                           "Sie haben alle Muster gehört", "Welches Muster war es?",
                           "Wie war es?", "Einige Fragen", "Vielen Dank"]  # fmt: skip


def test_agreement_answers_and_ratings_are_in_the_file(sat: Sat) -> None:
    told = [event["answers"] for event in sat.events if event["event"] == "told"]
    rated = [event["ratings"] for event in sat.events if event["event"] == "rated"]
    assert [e["language"] for e in sat.events if e["event"] == "agreed"] == ["de"]
    assert told == [{"age": 31, "handedness": None}, {"remarks": REMARK}]
    assert rated == [{"real": 5, "pleasant": 3}] * 4


def test_the_vibration_is_heard_in_the_browser(sat: Sat) -> None:
    assert sat.events[0]["hear"] is True
    assert np.isfinite(sat.loudest)
    assert sat.loudest > 0.01


def test_the_experimenter_sees_what_is_presented(sat: Sat) -> None:
    first = next(event for event in sat.events if event["event"] == "presented")
    assert first["pattern"] in sat.desk


def test_warmth_is_shown_in_the_browser_as_colour_that_grows(sat: Sat) -> None:
    assert len({text.partition("--grown")[2] for text in sat.warmths}) > 2
    assert {text.split()[0] for text in sat.warmths} <= {"warm", "kalt", "neutral"}
