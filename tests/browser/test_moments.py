"""The page that `replay --view` writes, opened as a file in a real browser."""

import io
import pathlib
import re
import wave
from typing import get_args

import numpy as np
import pytest
from dashboard_scene import AXE
from pace import until
from phone import COUNT_VIBRATIONS, PHONE
from playwright.sync_api import expect
from recorded_session import record
from saved_zip import unpacked

from hapticvlm import messages
from hapticvlm.commands.main import main

pytestmark = [pytest.mark.nightly, pytest.mark.browser]

PIXELS = """() => {
  const canvas = document.getElementById("frame");
  return [...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data];
}"""
# The columns of the card's wave in which something vibrated.
WAVE = """() => {
  const pen = document.getElementById("card").getContext("2d");
  const { width, data } = pen.getImageData(28, 200, 416, 1);
  return Array.from({ length: width }, (_, at) => data[4 * at] === 69).filter(Boolean).length;
}"""
SHOWN = "() => document.getElementById('clock').textContent.includes(' of ')"


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """The address that `replay --view` prints for a session of two seconds."""
    session = record(tmp_path_factory.mktemp("record"))
    assert main(["replay", str(session), "--view"]) == 0
    return (session / "session.html").as_uri()


@pytest.fixture
def page(browser, address):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(30_000)
    problems = []
    page.on("pageerror", lambda error: problems.append(error))
    page.on("request", lambda request: problems.append(request.url) if _leaves(request) else None)
    page.goto(address)
    page.wait_for_function(SHOWN)
    yield page
    page.close()
    assert not problems


def _leaves(request):
    return not request.url.startswith(("file:", "data:"))


def at(page, time_s):
    page.locator("#scrubber").fill(str(time_s))


def test_a_moment_says_what_was_touched_decided_and_felt(page):
    at(page, 1.0)
    expect(page.locator("#name")).to_have_text("Tea mug")
    expect(page.locator("#material")).to_have_text("ceramic")
    expect(page.locator("#told")).to_contain_text("by its name")
    expect(page.locator("#warmth")).to_contain_text("plate measured31.0 °C")
    at(page, 0.2)
    expect(page.locator("#touching")).to_have_text("nothing is touched")
    expect(page.locator("#material")).to_have_text("")


def test_each_source_of_a_decision_has_its_words(browser, address, tmp_path):
    markup = pathlib.Path(address.removeprefix("file://")).read_text(encoding="utf-8")
    assert '"source": "name"' in markup
    page = browser.new_page()
    words = {}
    for source in get_args(messages.Rung):
        file = tmp_path / f"{source}.html"
        file.write_text(markup.replace('"source": "name"', f'"source": "{source}"'), "utf-8")
        page.goto(file.as_uri())
        page.wait_for_function(SHOWN)
        at(page, 1.0)
        words[source] = page.locator("#told").inner_text()
    page.close()
    assert [source for source, text in words.items() if "undefined" in text] == []
    assert "by its texture" in words["texture"]


def test_a_link_opens_at_its_time_and_a_touch_is_such_a_link(page, address):
    page.goto(f"{address}#t=1.25")
    expect(page.locator("#clock")).to_contain_text("1.25 of")
    page.locator("#touches a").click()
    expect(page.locator("#clock")).to_contain_text("0.50 of")
    assert page.url.endswith("#t=0.50")
    at(page, 0.75)
    page.locator("#link").click()
    expect(page.locator("#copied")).not_to_be_empty()
    assert page.url.endswith("#t=0.75")


def test_the_touch_of_a_moment_is_saved_and_a_moment_without_one_says_so(page):
    at(page, 1.0)
    expect(page.locator("#feels")).to_have_text(re.compile("^feels like ceramic: slide"))
    expect(page.locator("#frame")).to_have_attribute("data-frame", "0")
    with page.expect_download() as download:
        page.locator("#save").click()
    assert download.value.suggested_filename == "felt-ceramic-slide.zip"
    files = unpacked(download.value.path())
    with wave.open(io.BytesIO(files["wav"])) as sound:  # from the contact until it has faded
        assert sound.getnframes() / sound.getframerate() == pytest.approx(1.5, abs=0.1)
    expect(page.locator("#copied")).to_contain_text("Saved felt-ceramic-slide.zip")
    at(page, 0.2)
    page.locator("#save").click()
    expect(page.locator("#copied")).to_contain_text("Not saved: nothing is touched")


def test_a_page_to_send_on_opens_at_its_moment_and_says_what_it_is_without_a_script(
    browser, address, tmp_path
):
    session = pathlib.Path(address.removeprefix("file://")).parent
    out = tmp_path / "felt.html"
    assert main(["replay", "--share", "--out", str(out), str(session)]) == 0
    page = browser.new_page()
    page.goto(out.as_uri())
    page.wait_for_function(SHOWN)
    assert page.title() == "Tea mug: felt as ceramic"
    assert 0.5 <= page.locator("#scrubber").evaluate("it => Number(it.value)") <= 1.6
    page.close()
    quiet = browser.new_context(java_script_enabled=False).new_page()
    quiet.goto(out.as_uri())
    expect(quiet.locator("noscript img")).to_be_visible()
    quiet.context.close()


def test_the_touched_object_is_outlined_in_the_frame(page):
    def dark() -> int:
        """Return how many pixels are; the frame itself is white."""
        pixels = np.array(page.evaluate(PIXELS)).reshape(-1, 4)[:, :3]
        return int((pixels.min(axis=1) < 200).sum())

    at(page, 1.0)
    until(lambda: 50 < dark() < 1500)
    at(page, 0.2)
    until(lambda: dark() == 0)


def test_the_card_beside_the_touched_object_stays_while_it_is_paused(browser, address):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.clock.install()
    page.goto(address)
    page.wait_for_function(SHOWN)
    card = page.locator("#card")
    at(page, 0.2)
    expect(card).to_be_hidden()
    at(page, 1.0)
    expect(card).to_be_visible()
    page.wait_for_function(WAVE)
    page.clock.run_for(6_000)
    expect(card).to_be_visible()
    box, frame = card.bounding_box(), page.locator("#frame").bounding_box()
    beside = box["x"] - (frame["x"] + frame["width"] / 2)
    assert 10 < beside < 140
    at(page, 0.55)
    page.wait_for_function(f"() => 0 < ({WAVE})() && ({WAVE})() < 30")  # no older than the touch
    page.close()


def test_the_vibration_of_the_record_is_what_sounds(page):
    assert page.locator("#voice").input_value() == "sound"
    page.locator("#voice").select_option("true")
    heard = page.evaluate(
        """async () => {
          const data = await (await fetch(document.getElementById("sound").src)).arrayBuffer();
          const wave = await new OfflineAudioContext(1, 8000, 8000).decodeAudioData(data);
          return { seconds: wave.duration, samples: [...wave.getChannelData(0)] };
        }"""
    )
    wave = np.abs(np.array(heard["samples"]))
    rate = wave.size / heard["seconds"]
    loud = np.flatnonzero(wave > 1e-2) / rate
    assert loud.min() == pytest.approx(0.5, abs=0.02)
    assert 1.4 < loud.max() < 1.6


def test_a_phone_vibrates_with_the_touch_and_not_before(browser, address):
    context = browser.new_context(viewport=PHONE, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.add_init_script(COUNT_VIBRATIONS)
    page.goto(f"{address}#t=0.1")
    page.wait_for_function(SHOWN)
    page.locator("#play").tap()
    page.wait_for_function("() => vibrations.some(Boolean)")
    assert page.evaluate("vibrations[0]") == 0
    page.locator("#play").tap()
    page.wait_for_function("() => vibrations.at(-1) === 0")
    context.close()


def test_the_page_is_clean_for_assistive_tools_light_dark_and_on_a_phone(page):
    at(page, 1.0)
    for scheme, width in (("light", 1280), ("dark", 1280), ("dark", 390)):
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 800})
        page.evaluate(AXE.read_text())  # the page's policy lets no script tag in
        found = page.evaluate("async () => (await axe.run()).violations.map((v) => v.id)")
        assert found == [], (scheme, width)
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_script_that_gets_into_the_page_does_not_run(page):
    ran = page.evaluate("""async () => {
      for (const script of [{ textContent: "ran = 1" }, { src: "data:text/javascript,ran = 2" }])
        document.body.append(Object.assign(document.createElement("script"), script));
      document.body.insertAdjacentHTML("beforeend", '<img src="data:," onerror="ran = 3">');
      await new Promise((resolve) => setTimeout(resolve, 500));
      return globalThis.ran ?? null;
    }""")
    assert ran is None
