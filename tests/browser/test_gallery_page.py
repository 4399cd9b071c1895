"""The page of touches that `feel --save FILE.html` writes, opened as a file in a real browser."""

import io
import json
import wave

import numpy as np
import pytest
from phone import COUNT_VIBRATIONS, PHONE
from playwright.sync_api import expect
from saved_zip import unpacked

from hapticvlm.commands.main import main

pytestmark = [pytest.mark.nightly, pytest.mark.browser]
FORMATS = ("haptic", "ahap")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    path = tmp_path_factory.mktemp("gallery") / "wood.html"
    assert main(["feel", "wood", "--seconds", "0.6", "--save", str(path)]) == 0
    return path.as_uri()


@pytest.fixture
def page(browser, address):
    page = browser.new_page(viewport={"width": 390, "height": 800})
    problems = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("requestfailed", lambda request: problems.append(request.url[:60]))
    page.goto(address)
    yield page
    page.close()
    assert not problems


def test_touches_are_played_and_taken_away_without_a_network(page):
    assert page.locator(".play").count() == 6
    assert "rgb" in page.locator(".bar").first.evaluate("it => it.style.background")
    tap, slide = (
        page.get_by_role("button", name=f"play wood, {kind}") for kind in ("tap", "slide")
    )
    tap.click()
    slide.click()
    expect(slide).to_have_attribute("aria-pressed", "true")
    expect(tap).to_have_attribute("aria-pressed", "false")
    expect(slide).to_have_attribute("aria-pressed", "false")  # it ended by itself
    assert page.locator("#told").inner_text() == ""
    page.get_by_text("Save wood, strike").click()
    for kind in FORMATS:
        with page.expect_download() as given:
            page.get_by_role("button", name=f".{kind} of wood, strike").click()
        assert given.value.suggested_filename == f"wood-strike.{kind}"
        assert json.loads(given.value.path().read_text())
    with page.expect_download() as given:
        page.get_by_role("button", name=".wav of wood, strike").click()
    with wave.open(io.BytesIO(given.value.path().read_bytes())) as sound:
        samples = np.frombuffer(sound.readframes(sound.getnframes()), "<i2")
        assert sound.getnframes() / sound.getframerate() == pytest.approx(0.6, abs=0.01)
    assert np.abs(samples).max() > 1000


def test_a_touch_is_saved_whole_with_the_files_of_the_page(page):
    page.get_by_text("Save wood, slide").click()
    with page.expect_download() as given:
        page.get_by_role("button", name=".haptic of wood, slide").click()
    haptic = json.loads(given.value.path().read_text())
    with page.expect_download() as given:
        page.get_by_role("button", name="everything of wood, slide").click()
    assert given.value.suggested_filename == "felt-wood-slide.zip"
    assert json.loads(unpacked(given.value.path())["haptic"]) == haptic
    expect(page.locator("#told")).to_contain_text("Saved felt-wood-slide.zip: picture, sound")


def test_a_touch_asked_for_before_the_last_one_began_plays_and_nothing_is_told(page):
    first = page.evaluate("""async () => {
        const [first, second] = document.querySelectorAll(".play");
        first.click();
        second.click();
        const isOn = (button) => button.getAttribute("aria-pressed") === "true";
        while (!isOn(second)) await new Promise(requestAnimationFrame);
        return isOn(first);
    }""")
    assert not first
    assert page.locator("#told").inner_text() == ""


def test_a_phone_vibrates_with_a_touch_and_rests_when_it_is_stopped(browser, address):
    context = browser.new_context(viewport=PHONE, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.add_init_script(COUNT_VIBRATIONS)
    page.goto(address)
    page.get_by_role("button", name="play wood, slide").tap()
    page.wait_for_function("() => vibrations.some((ms) => 0 < ms && ms <= 100)")
    page.wait_for_function("() => vibrations.at(-1) === 0")  # it ended by itself
    context.close()
