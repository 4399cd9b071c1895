"""The folder of `hapticvlm demo --static` on a plain file server, in Chromium, without a service.

What is replaced is hardware: the motors of a gamepad and of a phone.
"""

import itertools
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dashboard_scene import AXE, PATIENCE_MS
from pace import PACE
from phone import PHONE, complaints
from playwright.sync_api import Browser, Page, expect
from static_server import served
from webxr_scene import EXAMPLES, SLOW_MS

from hapticvlm.demo import static_site
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import IMPACTS, INTERACTIONS

pytestmark = [pytest.mark.browser, pytest.mark.needs_toolchain("chromium", "three")]

LEAST_DB = -30.0  # re full scale, at the loudness that the page begins with
GRID = list(itertools.product(MATERIALS, INTERACTIONS))
FEW = [("glass", "strike"), ("fabric", "press"), ("wood", "slide")]
# A gamepad and a phone that count the pictures drawn between the newest contact and their pulse.
MOTORS = """
  window.frames = 0;
  window.pulses = {gamepad: [], phone: []};
  const count = () => { frames++; requestAnimationFrame(count); };
  requestAnimationFrame(count);
  const pulse = (motor, strength) => strength > 0 && pulses[motor].push({frame: frames, strength});
  const playEffect = async (_, {strongMagnitude}) => pulse('gamepad', strongMagnitude);
  navigator.getGamepads = () => [{id: 'pad', vibrationActuator: {playEffect}}];
  navigator.vibrate = (ms) => Boolean(pulse('phone', ms)) || true;
"""
# Measures what leaves the page behind a fourth-order Butterworth high-pass at 350 Hz.
LISTEN = """async () => {
  const {sound} = await import('/hear.js');
  await sound.start();
  const {context} = sound.output;
  const q = [0.5412, 1.3066].map((factor) => 20 * Math.log10(factor));
  const pass = q.map((Q) => new BiquadFilterNode(context, {type: 'highpass', frequency: 350, Q}));
  const meter = context.createScriptProcessor(2048, 1, 1); // 43 to 46 ms
  window.loudest = 0;
  meter.onaudioprocess = ({inputBuffer}) => {
    const samples = inputBuffer.getChannelData(0);
    const power = samples.reduce((sum, sample) => sum + sample * sample, 0) / samples.length;
    loudest = Math.max(loudest, power);
  };
  sound.output.connect(pass[0]).connect(pass[1]).connect(meter).connect(context.destination);
  window.meter = meter;
}"""
# Plays a gesture until it is heard, and felt within `most` pictures; a busy machine may be late.
PLAY = """async ([material, kind, least, most, patience]) => {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const end = performance.now() + patience;
  const link = document.getElementById(`${material}/${kind}`);
  const played = {};
  const isDone = () => played.level > least && Math.max(...played.first) <= most;
  do {
    window.loudest = pulses.gamepad.length = pulses.phone.length = 0;
    const at = frames;
    link.click();
    const over = performance.now() + 2000;
    do {
      await wait(20);
      played.level = 10 * Math.log10(loudest + 1e-20);
      played.first = Object.values(pulses).map(([pulse]) => pulse ? pulse.frame - at : 1e9);
    } while (!isDone() && performance.now() < over);
    played.strongest = Math.max(0, ...pulses.gamepad.map(({strength}) => strength));
    document.getElementById('stop').click();
    await wait(200);
  } while (!isDone() && performance.now() < end);
  return played;
}"""


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("static") / "site"
    static_site.write(EXAMPLES, folder)
    with served(folder.parent) as root:  # as a web host serves a project below its address
        yield f"{root}site/"


@pytest.fixture(scope="module")
def gallery(browser: Browser, address: str) -> Iterator[Page]:
    page = browser.new_page()
    yield from opened(page, f"{address}#glass/strike")


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


@pytest.mark.parametrize("page", ["", "scene/webxr/"])
@pytest.mark.parametrize("missing", ["scene/webxr/lib", "scene/webxr/client/feel.true.json"])
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


def test_a_link_opens_at_its_moment_and_enter_plays_it(gallery: Page) -> None:
    expect(gallery.locator(".opened")).to_be_focused()
    expect(gallery.locator("#told")).to_contain_text("Enter")
    gallery.keyboard.press("Enter")
    gallery.wait_for_function("() => pulses.gamepad.length > 0", timeout=PATIENCE_MS)


@pytest.mark.parametrize(("width", "height"), [(1280, 900), (400, 800)])
def test_the_things_of_the_picture_are_touched_and_it_stays_where_it_is(
    browser: Browser, address: str, width: int, height: int
) -> None:
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(SLOW_MS)
    page.goto(address)
    swatch = page.locator("#photo")
    expect(page.locator("#told")).to_contain_text("Press or stroke")
    swatch.hover()
    before = swatch.bounding_box()
    page.mouse.down()
    expect(page.locator("#told")).to_have_text("wood, your hand")
    table = page.locator("#lit").get_attribute("points")
    swatch.hover(position=swatch.evaluate("(e) => ({x: e.clientWidth*.41, y: e.clientHeight*.38})"))
    expect(page.locator("#told")).to_have_text("metal, your hand")
    assert page.locator("#lit").get_attribute("points") != table
    expect(page.locator("#hear")).to_have_text("Sound on")
    assert swatch.bounding_box() == before
    page.close()


@pytest.mark.parametrize(
    ("fragment", "named"),
    [
        ("#gold/strike", '"gold"'),
        ("#glass/hit", '"hit"'),
        ("#glass/strike/x", '"strike/x"'),
        ("#glass/strike?speed=fast", 'speed "fast"'),
        ("#glass/strike?force=201", 'force "201"'),
        ("#glass/strike?speed=", 'speed ""'),
        ("#glass/strike?colour=1", '"colour"'),
        ("#%E0%A4%A", "%E0%A4%A"),
    ],
)
def test_a_wrong_link_is_named_and_the_page_opens_as_usual(
    gallery: Page, fragment: str, named: str
) -> None:
    gallery.evaluate("(fragment) => { location.hash = fragment; }", fragment)
    expect(gallery.locator("#told")).to_contain_text(named)
    assert gallery.locator(".opened").count() == 0
    assert gallery.locator("article").count() == len(MATERIALS)


# Opens at a link, plays it and returns the highest amplitude of its first vibration.
STRENGTH = """async (fragment) => {
  const {felt} = await import(new URL('gallery.js', document.baseURI));
  const changed = new Promise((done) => addEventListener('hashchange', done, {once: true}));
  location.hash = fragment;
  await changed;
  const strength = new Promise((done) => {
    felt.addEventListener('vibration', function first({detail: {amplitude = []}}) {
      if (!amplitude.length) return;
      felt.removeEventListener('vibration', first);
      done(Math.max(...amplitude));
    });
  });
  document.querySelector('.opened').click();
  await strength;
  document.getElementById('stop').click();
  return strength;
}"""


def test_a_link_states_how_fast_the_strike_is(gallery: Page) -> None:
    gentle, usual = (
        gallery.evaluate(STRENGTH, f"#wood/strike{query}")
        for query in ("?speed=0.1&force=1", "?speed=0.8")
    )
    print({"gentle": gentle, "usual": usual})
    assert 0 < gentle < 0.7 * usual


def test_a_copied_link_opens_at_the_moment_that_was_played(gallery: Page) -> None:
    gallery.evaluate("() => { location.hash = '#stone/slide?speed=0.75'; }")
    expect(gallery.locator(".opened")).to_have_attribute("id", "stone/slide")
    gallery.locator(".opened").click()
    expect(gallery.locator("#told")).to_have_text("stone, slide")
    gallery.evaluate("() => { location.hash = ''; }")
    gallery.locator("#link").click()
    expect(gallery.locator("#link")).not_to_have_text("Copy link")
    assert gallery.url.endswith("#stone/slide?speed=0.75")
    gallery.get_by_role("link", name="press leather").click()
    expect(gallery.locator("#told")).to_have_text("leather, press")
    gallery.locator("#link").click()
    expect(gallery.locator("#link")).not_to_have_text("Copy link")
    assert gallery.url.endswith("#leather/press")


@pytest.mark.parametrize(
    ("material", "kind"),
    [*FEW, *(pytest.param(*one, marks=pytest.mark.nightly) for one in GRID if one not in FEW)],
)
def test_each_gesture_is_heard_by_a_small_speaker_and_felt_in_the_next_picture(
    gallery: Page, material: str, kind: str
) -> None:
    if not gallery.evaluate("Boolean(window.meter)"):
        gallery.evaluate(LISTEN.replace("'/hear.js'", "new URL('hear.js', document.baseURI)"))
    most = 1 if kind in IMPACTS else 1_000  # a stroke begins slowly
    played = gallery.evaluate(PLAY, [material, kind, LEAST_DB, most, PATIENCE_MS])
    print(material, kind, played)
    assert played["level"] > LEAST_DB
    assert played["strongest"] > 0.1
    assert max(played["first"]) <= most


@pytest.mark.nightly
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_axe_finds_nothing_in_the_gallery(gallery: Page, width: int, height: int) -> None:
    gallery.set_viewport_size({"width": width, "height": height})
    gallery.evaluate(AXE.read_text(encoding="utf-8"))
    violations = gallery.evaluate("axe.run()")["violations"]
    assert [entry["id"] for entry in violations] == []
    assert gallery.evaluate("document.scrollingElement.scrollWidth") <= width
    gallery.evaluate("scrollTo(0, 0)")  # the header stays in front while the page scrolls
    assert width > PHONE["width"] or complaints(gallery) == []


# Presses an object of the room; the pictures until the phone's motor, and what the page says.
PRESS = """async ([key, patience]) => {
  const main = await import(new URL('main.js', document.baseURI));
  const three = await import('three');
  const {root} = main.objects.find((one) => one.key === key);
  const at = new three.Box3().setFromObject(root).getCenter(new three.Vector3());
  at.project(main.camera);
  const canvas = document.getElementById('view');
  const where = {
    clientX: (at.x + 1) / 2 * canvas.clientWidth, clientY: (1 - at.y) / 2 * canvas.clientHeight,
  };
  const send = (type) =>
    canvas.dispatchEvent(new PointerEvent(type, {...where, pointerId: 1, bubbles: true}));
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
