"""The dashboard's first screen: outputs, a stop that never moves, test touches, how to connect."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from conftest import status
from dashboard_scene import (
    AXE,
    dashboard,
    idling,
    touching,
)
from pace import until
from playwright.sync_api import Browser, Page, Route, expect
from qr_codes import read_from_page

from hapticvlm.client import Client
from hapticvlm.client.local_service import Service, running

pytestmark = pytest.mark.browser

SCREEN, PHONE = (1280, 800), (390, 844)
LOOKS: dict[Any, tuple[int, int]] = {"light": SCREEN, "dark": PHONE}
OUTPUTS = ("plate", "plate-scale", "plate-chart", "level-word", "ribbon-chart", "wave-chart")
FAULT = """async () => {
  const faults = await import("./faults.js");
  const plate = { faults: { a: "it is hot (a): wait" } };
  const low = "it is muted (speaker_low): unmute it";
  faults.show({ plate, speaker: { plays: false, faults: { speaker_low: low } } });
  faults.trouble({ code: "model", text: "the recogniser was restarted" });
}"""
PLACE = """(id) => {
  const { x, y, width, height } = document.getElementById(id).getBoundingClientRect();
  return [x, y, width, height];
}"""
SCROLLED = """(share) => {
  scrollTo(0, share * document.body.scrollHeight);
  const { x, y, width, height } = document.getElementById("stop").getBoundingClientRect();
  return [x, y, width, height];
}"""
PIXELS = """async () => {
  const canvas = document.getElementById("frame");
  const at = (x, y) => [...canvas.getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3);
  return { outside: at(8, 8), inside: at(112, 112), line: at(112, 54) };
}"""
# How long after a key a chart that was to change in the next frame is painted, ms.
PAINTED = """async () => {
  const { Chart } = await import("./chart.js");
  const canvas = document.body.appendChild(document.createElement("canvas"));
  let paintedAt = null;
  const chart = new Chart(canvas, () => (paintedAt = performance.now()));
  const painted = async () => {
    while (paintedAt === null) await new Promise((done) => setTimeout(done, 5));
    return paintedAt;
  };
  await painted();
  paintedAt = null;
  const key = new KeyboardEvent("keydown", { key: "Shift" });
  document.dispatchEvent(key);
  chart.change();
  return (await painted()) - key.timeStamp;
}"""
YIELD_MS = 60.0
FELT = re.compile(r"0\.\d*[1-9]")


def states(page: Page, service: Service) -> Iterator[str]:
    """Bring the page into each of its states, in turn."""
    yield "idle"
    with touching(service.url):
        expect(page.locator("#objects li")).to_have_count(4)
        yield "touched"
    page.evaluate(FAULT)
    yield "fault"
    page.keyboard.press("Escape")
    expect(page.locator("#stopped")).to_contain_text("Stopped at")
    yield "stopped"
    service.process.kill()
    expect(page.locator("#gone")).to_contain_text("Service unreachable since")
    yield "gone"


@pytest.fixture(scope="module")
def seen(browser: Browser) -> dict[str, Any]:
    """What each state of the page shows where, light and large, dark and on a phone."""
    found: dict[str, Any] = {}
    for scheme, size in LOOKS.items():
        with (
            running() as service,
            dashboard(browser, service.page, size, color_scheme=scheme) as page,
        ):
            page.evaluate(AXE.read_text(encoding="utf-8"))
            for state in states(page, service):
                found[f"{state}, {scheme}"] = {
                    "stop": [page.evaluate(SCROLLED, share) for share in (1, 0)],
                    "outputs": {name: page.evaluate(PLACE, name) for name in OUTPUTS},
                    "wide": page.evaluate("document.scrollingElement.scrollWidth") - size[0],
                    "axe": page.evaluate("axe.run()")["violations"],
                }
    return found


@pytest.mark.nightly
def test_what_a_key_changes_is_painted_before_the_charts(browser: Browser) -> None:
    with running() as service, dashboard(browser, service.page, SCREEN) as page:
        assert page.evaluate(PAINTED) > YIELD_MS - 1


@pytest.mark.nightly
def test_the_stop_has_one_place_in_view_in_every_state_however_far_the_page_is_scrolled(
    seen: dict[str, Any],
) -> None:
    for scheme, size in LOOKS.items():
        states = [one for name, one in seen.items() if name.endswith(scheme)]
        assert len(states) == 5
        [(x, y, width, height)] = {tuple(place) for one in states for place in one["stop"]}
        assert 0 <= x <= size[0] - width
        assert 0 <= y <= size[1] - height


@pytest.mark.nightly
def test_both_outputs_are_on_the_first_screen_in_every_state(seen: dict[str, Any]) -> None:
    for name, state in seen.items():
        if not name.endswith("light"):
            continue
        for output, (x, y, width, height) in state["outputs"].items():
            assert x >= 0, (name, output)
            assert y >= 0, (name, output)
            assert x + width <= SCREEN[0], (name, output)
            assert y + height <= SCREEN[1], (name, output)
            assert min(width, height) >= 15, (name, output)


@pytest.mark.nightly
def test_axe_finds_nothing_in_any_state(seen: dict[str, Any]) -> None:
    said = {name: [one["id"] for one in state["axe"]] for name, state in seen.items()}
    assert {name: ids for name, ids in said.items() if ids} == {}


@pytest.mark.nightly
def test_nothing_scrolls_sideways(seen: dict[str, Any]) -> None:
    assert {name: one["wide"] for name, one in seen.items() if one["wide"] > 0} == {}


def test_a_pressed_test_touch_moves_both_outputs_and_gives_them_back(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        page.select_option("#trial-material", "metal")
        page.locator("#trial-heat").fill("5")
        page.locator(".interaction[data-interaction=slide]").hover()
        page.mouse.down()
        expect(page.locator("#owner")).to_contain_text("dashboard test touch")
        expect(page.locator("#material")).to_have_text("metal")
        expect(page.locator("#level")).to_have_text(FELT)
        until(lambda: status(service)["plate"]["setpoint_c"] < 30.0)
        page.mouse.up()
        expect(page.locator("#level")).to_have_text("0.000")
        until(lambda: status(service)["leases"] == 0)
        expect(page.locator("#owner")).to_contain_text("Nobody owns")


@pytest.mark.nightly
def test_the_first_test_touch_after_a_stop_is_felt(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        stroke = page.locator(".interaction[data-interaction=slide]")
        stroke.hover()
        page.mouse.down()
        expect(page.locator("#level")).to_have_text(FELT)
        page.keyboard.press("Escape")
        expect(page.locator("#stopped")).to_contain_text("Release and touch again to continue.")
        page.mouse.up()
        expect(page.locator("#level")).to_have_text("0.000")
        stroke.hover()
        page.mouse.down()
        expect(page.locator("#level")).to_have_text(FELT)
        expect(page.locator("#stopped")).to_be_empty()
        expect(page.locator("#trial-told")).to_have_text(re.compile("^This page owns"))
        page.mouse.up()
        expect(page.locator("#owner")).to_contain_text("Nobody owns")


def test_a_stop_of_somebody_else_is_told_only_while_a_scene_may_go_on(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        command = [sys.executable, "-m", "hapticvlm", "stop", "--url", service.url]
        subprocess.run(command, check=True, capture_output=True)
        with page.expect_response("**/status"):
            pass
        expect(page.locator("#service")).to_contain_text("stopped until released")
        expect(page.locator("#stopped")).to_be_empty()
        with idling(service.url):
            expect(page.locator("#stopped")).to_contain_text("Release and touch again")


FELT_WORDS = {"gentle", "clear", "strong"}
KEEP_WORDS = """() => {
  const word = document.getElementById("level-word");
  window.words = [];
  const keep = new MutationObserver(() => words.push(word.textContent));
  keep.observe(word, {childList: true, characterData: true, subtree: true});
}"""


@pytest.mark.nightly
def test_the_gesture_of_this_moment_is_said_with_the_material(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        page.evaluate(KEEP_WORDS)
        # A strike is held after it, and a slide goes on.
        for interaction, gesture in (("strike", "held still"), ("slide", "slide, ")):
            page.locator(f".interaction[data-interaction={interaction}]").hover()
            page.evaluate("words.length = 0")
            page.mouse.down()
            expect(page.locator("#feel-pattern")).to_contain_text(f"feels like wood: {gesture}")
            for look in range(600):  # a strike is over when one looks: each word is kept
                if FELT_WORDS & set(page.evaluate("words")):
                    break
                page.wait_for_timeout(50)
                if look % 60 == 59:  # one that comes too late on a busy machine is not felt
                    page.mouse.up()
                    page.mouse.down()
            else:
                pytest.fail(f"nothing is felt of a {interaction}")
            page.mouse.up()
            expect(page.locator("#feel-pattern")).to_have_text("vibrates like wood")
        page.locator(".interaction[data-interaction=swing]").hover()
        page.mouse.down()
        expect(page.locator("#feel-pattern")).to_contain_text("a swing through the air, ")
        page.mouse.up()
        expect(page.locator("#feel-pattern")).to_have_text("vibrates like wood")
        expect(page.locator("#verdict")).to_have_text("You chose it above.")
        expect(page.locator("#rungs")).to_contain_text("not needed")
        expect(page.locator("#owner")).to_contain_text("Nobody owns")


@pytest.mark.nightly
def test_a_key_is_a_test_touch_too(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        page.locator(".interaction[data-interaction=slide]").focus()
        page.keyboard.down("Enter")
        expect(page.locator("#level")).to_have_text(FELT)
        page.keyboard.up("Enter")
        expect(page.locator("#owner")).to_contain_text("Nobody owns")


def test_while_a_scene_owns_the_outputs_a_test_touch_says_so_and_moves_nothing(
    service: Service, browser: Browser
) -> None:
    with (
        dashboard(browser, service.page, SCREEN) as page,
        touching(service.url, only="kettle"),
    ):
        expect(page.locator("#owner")).to_contain_text("test scene")
        page.locator(".interaction[data-interaction=strike]").click(delay=300)
        expect(page.locator("#trial-told")).to_contain_text("Another scene owns the outputs")


@pytest.mark.nightly
def test_a_frame_stands_beside_its_own_decision_outlined_by_its_mask(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page, idling(service.url, masked_frame):
        page.get_by_role("button", name="Object_07").click()
        expect(page.locator("#frame-said")).to_contain_text("Object_07; outlined by its mask")
        assert page.locator("#object").inner_text() == "Object_07"
        pixels = page.evaluate(PIXELS)
        assert pixels["line"] == [255, 255, 255]
        assert np.mean(pixels["outside"]) < 0.7 * 200
        assert np.mean(pixels["inside"]) > 0.9 * 200
        page.get_by_role("button", name="kettle").click()
        expect(page.locator("#frame")).to_be_hidden()
        expect(page.locator("#frame-why")).to_contain_text("the scene was enough")


def test_what_a_person_says_an_object_is_decides_and_may_be_said_again(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page, idling(service.url, masked_frame):
        page.get_by_role("button", name="Object_07").click()
        for material in ("glass", "fabric"):
            say(page, material)
            expect(page.locator("#material")).to_have_text(material)
        page.get_by_role("button", name="kettle").click()
        expect(page.locator("#material")).to_have_text("metal")
        expect(page.locator("#teach")).to_be_hidden()  # its scene has said what it is


def test_the_surface_that_is_corrected_leaves_the_others_of_its_object_as_they_are(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page, idling(service.url, room_of_surfaces):
        page.get_by_role("button", name="Hall, mat14").click()
        say(page, "leather")
        expect(page.locator("#material")).to_have_text("leather")
        say(page, "paper")
        expect(page.locator("#material")).to_have_text("paper")
        page.get_by_role("button", name="Hall, Oak_Floor").click()
        expect(page.locator("#material")).to_have_text("wood")


@pytest.mark.nightly
def test_what_was_said_while_the_list_of_it_was_on_its_way_may_be_said_again(
    service: Service, browser: Browser
) -> None:
    lists: list[Route] = []
    with dashboard(browser, service.page, SCREEN) as page:
        page.route("**/stated.json", lambda route: lists.append(route))
        with idling(service.url, masked_frame):
            tile = page.get_by_role("button", name="Object_07")
            tile.click()
            say(page, "glass")
            while not lists:
                page.wait_for_timeout(50)
            lists.pop().fulfill(json={"objects": []})  # from before anything was said
            page.wait_for_timeout(300)
            tile.click()
            say(page, "fabric")


def say(page: Page, material: str) -> None:
    page.locator("#teach-material").select_option(material)
    page.get_by_role("button", name="Correct it").click()
    expect(page.locator("#teach-told")).to_contain_text(f"Corrected to {material}")


@pytest.mark.nightly
def test_at_rest_it_offers_touches_and_a_pressed_one_stays_where_it_is(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        expect(page.locator("#decision-card")).to_be_hidden()
        expect(page.locator("#details")).to_be_hidden()
        stroke = page.locator(".interaction[data-interaction=slide]")
        place = stroke.bounding_box()
        stroke.hover()
        page.mouse.down()
        expect(page.locator("#decision-card")).to_be_visible()
        expect(page.locator("#welcome-card")).to_be_hidden()
        assert stroke.bounding_box() == place
        page.mouse.up()
        expect(page.locator("#owner")).to_contain_text("Nobody owns")


SHOW_ANOTHER = """async () => {
  const frame = await import("./frame.js");
  const canvas = document.getElementById("frame");
  const alpha = () => canvas.getContext("2d").getImageData(112, 112, 1, 1).data[3];
  const picture = new OffscreenCanvas(224, 224);
  picture.getContext("2d").fillRect(0, 0, 224, 224);
  const bytes = new Uint8Array(await (await picture.convertToBlob()).arrayBuffer());
  const image = btoa(String.fromCharCode(...bytes));
  const view = { image, format: "png", origin: "top", mask: null, region: null };
  for (const object_id of ["one", "two"]) frame.take({ ...view, object_id });
  const drawn = async () => {
    for (let i = 0; i < 500 && !alpha(); i++) await new Promise((go) => setTimeout(go, 10));
    return alpha();
  };
  frame.show("one", "one", "");
  const first = await drawn();
  frame.show("two", "two", "");
  return { first, atOnce: alpha(), second: await drawn() };
}"""


@pytest.mark.nightly
def test_a_frame_leaves_the_screen_before_the_next_decision_comes(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        assert page.evaluate(SHOW_ANOTHER) == {"first": 255, "atOnce": 0, "second": 255}


VIEW_AS_A_WHOLE = """async () => {
  const decisions = await import("./decisions.js");
  const decision = { material: "wood", source: "name", confidence: 0.9, evidence: [] };
  decisions.take({ ...decision, object_id: "table", pattern: "wood slide" });
  decisions.take({ ...decision, material: "unknown", source: "unknown", object_id: null });
}"""


@pytest.mark.nightly
def test_a_view_as_a_whole_takes_no_touched_object_off_the_screen(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        page.evaluate(VIEW_AS_A_WHOLE)
        expect(page.locator("#objects li")).to_have_count(2)
        expect(page.locator("#object")).to_have_text("table")


async def masked_frame(client: Client) -> None:
    """Show one grey frame with a mask of its middle, and touch a kettle."""
    grey = np.full((224, 224), 200, np.uint8)
    mask = np.zeros((224, 224), np.uint8)
    mask[56:168, 56:168] = 255
    image, outline = (cv2.imencode(".png", each)[1].tobytes() for each in (grey, mask))
    kettle = {"object_id": "kettle", "material": "metal"}
    await client.scene([{"object_id": "o7", "name": "Object_07"}, kettle])
    await client.touch("release", "kettle")
    await client.frame(image, 224, 224, format="png", object_id="o7", mask=outline)
    await client.touch("contact", "kettle", speed_mps=0.1, force_n=1.0)


async def room_of_surfaces(client: Client) -> None:
    """Touch both materials of one mesh."""
    surfaces = [{"name": "Oak_Floor"}, {"name": "mat14"}]
    await client.scene([{"object_id": "room", "name": "Hall", "surfaces": surfaces}])
    await client.touch("release", "room")
    for phase, surface in (("contact", 0), ("slide", 1)):
        await client.touch(phase, "room", surface=surface, speed_mps=0.1, force_n=1.0)


@pytest.mark.nightly
def test_idle_it_says_how_to_connect(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page, SCREEN) as page:
        expect(page.locator("#snippet")).to_be_hidden()
        page.get_by_text("Connect a scene").click()
        expect(page.locator("#address")).to_have_text(service.url)
        expect(page.locator("#snippet")).to_contain_text(f'connect("{service.url}")')
        for engine in ("Unity", "Godot", "Browser"):
            page.get_by_role("button", name=engine).click()
            expect(page.locator("#snippet")).to_contain_text(service.url)
        expect(page.locator("#qr")).to_be_hidden()
        expect(page.locator("#reach-said")).to_contain_text("hapticvlm serve --lan")


@pytest.mark.nightly
def test_the_lines_to_begin_with_run_as_they_are_copied(browser: Browser, tmp_path: Path) -> None:
    with running() as service, dashboard(browser, service.page, SCREEN) as page:
        page.get_by_text("Connect a scene").click()
        copied = tmp_path / "begin.py"
        copied.write_text(page.inner_text("#snippet"), encoding="utf-8")
        done = subprocess.run([sys.executable, copied], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        expect(page.locator("#object")).to_have_text("GlassCup")
        expect(page.locator("#material")).to_have_text("glass")


@pytest.mark.nightly
def test_a_service_that_is_gone_is_said_in_a_banner_and_covers_nothing(browser: Browser) -> None:
    with running() as service, dashboard(browser, service.page, SCREEN) as page:
        page.keyboard.press("Escape")
        expect(page.locator("#stopped")).to_contain_text("Stopped at")
        service.process.kill()
        expect(page.locator("#gone")).to_contain_text("Service unreachable since")
        tops = {name: page.evaluate(PLACE, name) for name in ("gone", "stopped", "screen", "link")}
        _, gone_y, width, high = tops["gone"]
        assert width > 0.9 * SCREEN[0]
        assert tops["stopped"][1] >= gone_y + high
        _, link_y, _, link_high = tops["link"]
        assert link_y >= 0
        assert link_y + link_high <= gone_y


@pytest.mark.nightly
def test_a_camera_reads_the_address_off_the_page_that_the_network_may_open(
    browser: Browser,
) -> None:
    token = "a-token-long-enough"
    options = ["--host", "0.0.0.0", "--token", token, "--pages-from", "lan"]
    with running(options) as service:
        port = service.page.rsplit(":", 1)[1].strip("/")
        with dashboard(browser, f"http://127.0.0.1:{port}/#token={token}", SCREEN) as page:
            page.get_by_text("Connect a scene").click()
            read = read_from_page(page)
            assert re.fullmatch(rf"http://[^/]+:{port}/", read)
            assert read.replace("http", "ws") in page.inner_text("#reach-said")
