"""The folder of `hapticvlm demo --static` on a plain file server, in Chromium, without a service.

What is replaced is hardware: the motors of a gamepad and of a phone.
"""

import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dashboard_scene import AXE, PATIENCE_MS
from pace import PACE
from phone import LISTEN, PHONE, complaints
from playwright.sync_api import Browser, Page, expect
from static_server import served
from try_page import at, sample
from webxr_scene import AIM, EXAMPLES, SLOW_MS

from hapticvlm.demo import static_site

pytestmark = [pytest.mark.browser, pytest.mark.needs_toolchain("chromium", "three")]

LEAST_DB = -30.0  # re full scale, at the loudness that the page begins with
# A gamepad and a phone that count the pictures drawn between the newest contact and their pulse.
MOTORS = """
  window.frames = 0;
  window.pulses = {gamepad: [], phone: []};
  const count = () => { frames++; requestAnimationFrame(count); };
  requestAnimationFrame(count);
  const pulse = (motor, strength) => strength > 0 && pulses[motor].push({frame: frames, strength});
  const playEffect = async (_, {strongMagnitude}) => pulse('gamepad', strongMagnitude);
  navigator.getGamepads = () => [{id: 'pad', vibrationActuator: {playEffect, reset() {}}}];
  navigator.vibrate = (ms) => Boolean(pulse('phone', ms)) || true;
"""
FORGET = "() => { loudest = pulses.gamepad.length = pulses.phone.length = 0; }"
IS_PLAYED = """(least) => 10 * Math.log10(loudest + 1e-20) > least
  && Math.max(0, ...pulses.gamepad.map(({strength}) => strength)) > 0.1
  && pulses.phone.length > 0"""
IS_STILL = """() => {
  const before = loudest;
  loudest = 0;
  return before < 1e-8;
}"""
THINGS = {"metal": (0.41, 0.38), "glass": (0.62, 0.3), "wood": (0.3, 0.9), "fabric": (0.86, 0.7)}


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("static") / "site"
    static_site.write(EXAMPLES, folder)
    with served(folder.parent) as root:  # as a web host serves a project below its address
        yield f"{root}site/"


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    phone = browser.new_context(
        viewport=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce"
    )
    for page in opened(phone.new_page(), address):
        expect(page.locator("#pane")).to_have_attribute("data-looked", "1", timeout=PATIENCE_MS)
        yield page
    phone.close()


def opened(page: Page, address: str) -> Iterator[Page]:
    """Open a page that has motors; it asks for nothing that is not there, and no service."""
    page.set_default_timeout(SLOW_MS)
    problems: list[Any] = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("websocket", lambda socket: problems.append(socket.url))
    page.on("response", lambda r: problems.append(r.url) if r.status >= 400 else None)
    page.on("console", lambda line: problems.append(line.text) if "Policy" in line.text else None)
    page.add_init_script(MOTORS)
    page.goto(address)
    yield page
    page.close()
    assert problems == []


def test_no_host_leaves_a_part_out_for_its_name(tmp_path: Path) -> None:
    static_site.write(EXAMPLES, tmp_path / "site")
    names = [path.relative_to(tmp_path).as_posix() for path in (tmp_path / "site").rglob("*")]
    assert [name for name in names if "node_modules" in name or name.endswith(".mjs")] == []


@pytest.mark.parametrize(
    ("page", "missing"),
    [
        ("", "try.scene.js"),
        ("", "scene/webxr/client/feel.true.json"),
        ("scene/webxr/", "scene/webxr/lib"),
        ("scene/webxr/", "scene/webxr/client/feel.true.json"),
    ],
)
def test_a_page_without_one_of_its_files_names_it(
    browser: Browser, tmp_path: Path, page: str, missing: str
) -> None:
    static_site.write(EXAMPLES, tmp_path)
    away = tmp_path / missing
    shutil.rmtree(away) if away.is_dir() else away.unlink()
    with served(tmp_path) as root:
        tab = browser.new_page()
        tab.goto(f"{root}{page}")
        status = tab.locator('[role="status"]').first
        expect(status).to_contain_text("cannot start", timeout=PATIENCE_MS)
        expect(status).to_be_in_viewport()
        names = status.text_content() or ""
        assert "feel.true.json" in names if missing.endswith("json") else ".js" in names
        tab.close()


@pytest.mark.parametrize("page", ["", "scene/webxr/"])
def test_a_page_runs_no_script_that_it_was_not_written_with(
    browser: Browser, address: str, page: str
) -> None:
    tab = browser.new_page()
    tab.goto(f"{address}{page}")
    ran = tab.evaluate("""() => {
      const script = document.createElement('script');
      script.textContent = 'window.ran = true;';
      document.head.append(script);
      return window.ran === true;
    }""")
    assert not ran
    tab.close()


@pytest.mark.parametrize("page", ["index.html", "scene/webxr/index.html"])
def test_a_page_opened_from_the_disk_says_what_it_needs(
    browser: Browser, tmp_path: Path, page: str
) -> None:
    static_site.write(EXAMPLES, tmp_path)
    tab = browser.new_page()
    tab.goto((tmp_path / page).as_uri())
    status = tab.locator('[role="status"]').first
    expect(status).to_contain_text("http.server", timeout=PATIENCE_MS)
    tab.close()


def press(page: Page, material: str) -> None:
    """Press the thing of a material, and stroke it until it is heard and both motors have run."""
    x, y = THINGS[material]
    at(page, x, y)
    expect(page.locator("#material")).to_have_text(material)
    page.mouse.down()
    gives_up_at = time.monotonic() + PATIENCE_MS / 1000
    page.evaluate(FORGET)
    while not page.evaluate(IS_PLAYED, LEAST_DB):
        assert time.monotonic() < gives_up_at, page.evaluate("[loudest, pulses]")
        at(page, x + 0.01, y)
        at(page, x, y)
    page.mouse.up()


def test_each_thing_is_heard_by_a_small_speaker_and_felt_until_the_stop(page: Page) -> None:
    at(page, *THINGS["metal"])
    page.mouse.down()
    expect(page.locator("#hear")).to_have_text("Sound on")
    page.mouse.up()
    page.evaluate(LISTEN)  # the sound has begun
    for material in THINGS:
        press(page, material)
        page.wait_for_function(IS_STILL, polling=200)  # some blocks of sound
        page.keyboard.press("Escape")  # while nothing is touched
        expect(page.locator("#stopped")).to_contain_text("Stopped at")


def test_a_picture_of_ones_own_is_felt_as_what_one_says_that_it_is(page: Page) -> None:
    sample(page, "kettle")
    at(page, 0.5, 0.5)
    expect(page.locator("#material")).to_have_text("Not recognised here")
    page.mouse.down()
    page.mouse.up()
    assert page.evaluate("pulses.gamepad.length") == 0
    page.get_by_text("Not right?", exact=True).click()
    page.locator("#correct-material").select_option("metal")
    expect(page.locator("#sure")).to_have_text("stated by you")
    at(page, 0.5, 0.5)
    page.mouse.down()
    page.wait_for_function("() => pulses.gamepad.length > 0", timeout=PATIENCE_MS)
    page.mouse.up()


def test_nothing_is_offered_that_needs_a_service(page: Page) -> None:
    for name in ("#camera", "#screen", "#token-form", "#take"):
        expect(page.locator(name)).to_be_hidden()
    page.get_by_text("Feel it on your phone").click()
    expect(page.locator("#reach-said")).to_contain_text("Open the address of this page")
    page.get_by_text("Settings").click()
    link = page.get_by_role("link", name="A room to touch")
    assert link.get_attribute("href") == "scene/webxr/"
    expect(page.get_by_role("link")).to_have_count(1)


# Presses an object of the room; the pictures until the phone's motor, and what the page says.
PRESS = (
    f"""async ([key, patience]) => {{{AIM}"""
    """
  send('pointermove');
  await new Promise((done) => setTimeout(done, 300));
  pulses.phone.length = 0;
  const begun = frames;
  send('pointerdown');
  const end = performance.now() + patience;
  while (!pulses.phone.length && performance.now() < end) {
    await new Promise((done) => setTimeout(done, 20));
  }
  const said = document.getElementById('said').textContent;
  send('pointerup');
  return {frames: pulses.phone[0]?.frame - begun, said};
}"""
)


# Opens the room at each of its objects and surfaces; those that the camera does not see.
HIDDEN = """async () => {
  const {objects} = await import(new URL('main.js', document.baseURI));
  const hidden = [];
  for (const {key, truths = [null]} of objects) {
    for (const target of truths.map((truth, surface) => (surface ? `${key} ${truth}` : key))) {
      location.hash = `#${encodeURIComponent(target)}/tap`;
      await new Promise((done) => addEventListener('hashchange', done, {once: true}));
      const button = document.getElementById('feel');
      if (button.hidden || button.textContent !== `Feel it: ${target}, tap`) hidden.push(target);
    }
  }
  return hidden;
}"""


@pytest.mark.nightly
def test_a_link_opens_the_room_at_its_moment(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport=PHONE, has_touch=True, is_mobile=True)
    visit = opened(page, f"{address}scene/webxr/#kettle/strike?speed=1.2")
    next(visit)
    feel = page.locator("#feel")
    expect(feel).to_be_focused(timeout=SLOW_MS)
    assert feel.inner_text() == "Feel it: kettle, strike"
    assert complaints(page) == []
    page.keyboard.press("Enter")
    page.wait_for_function("() => pulses.phone.length > 0", timeout=PATIENCE_MS)
    assert page.locator("#said").inner_text() == "The kettle is metal."
    page.evaluate("() => { location.hash = ''; }")
    page.locator("#link").click()
    expect(page.locator("#link")).not_to_have_text("Copy link")
    assert page.url.endswith("#kettle/strike?speed=1.2")
    assert page.evaluate(HIDDEN) == []
    page.evaluate("() => { location.hash = '#sofa/strike'; }")
    expect(page.locator("#hint")).to_contain_text('"sofa", which is not here')
    expect(feel).to_be_hidden()
    assert complaints(page) == []
    page.evaluate(AXE.read_text(encoding="utf-8"))
    violations = page.evaluate("axe.run()")["violations"]
    assert [entry["id"] for entry in violations] == []
    assert next(visit, None) is None


@pytest.mark.nightly
def test_the_room_is_felt_without_a_service(browser: Browser, address: str) -> None:
    page = browser.new_page(viewport={"width": 240, "height": 160})
    visit = opened(page, f"{address}scene/webxr/")
    next(visit)
    page.locator("#state", has_text=re.compile("without a service")).wait_for()
    pressed = page.evaluate(PRESS, ["kettle", 20_000 * PACE])
    assert pressed["said"] == "The kettle is metal."
    assert pressed["frames"] <= 1
    assert page.locator(".served:visible").count() == 0
    assert next(visit, None) is None
