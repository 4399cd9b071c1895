"""The page `/try`: a picture of one's own is dropped, pressed, slid over, corrected and stopped."""

from __future__ import annotations

import base64
import io
import itertools
import json
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from dashboard_scene import AXE, PATIENCE_MS
from grounds import GROUNDS, drawn
from matplotlib.cbook import get_sample_data
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from profiles import profile_with_red_and_green_swapped
from qr_codes import read_from_page
from static_server import served
from tiers import nightly_except
from try_page import DROP, PAGES, at, next_picture, sample, visit
from webxr_scene import EXAMPLES

from hapticvlm.client.local_service import Service, running
from hapticvlm.demo import static_site
from hapticvlm.vision import plain_ground
from hapticvlm.vision.bars import content_box
from hapticvlm.vision.files import read_frame

pytestmark = pytest.mark.browser

# The page's share of certainty comes within a margin of a figure, percent.
SURE = """([expected, margin]) =>
  Math.abs(parseInt(document.querySelector("#because dd").textContent) - expected) <= margin"""
OUTLINE = """async ([data, width, height]) => {
  const { outline } = await import("./try.outline.js");
  const pixels = Uint8ClampedArray.from(atob(data), (letter) => letter.charCodeAt(0));
  const thing = outline(pixels, width, height);
  return thing && [...thing];
}"""

CONTENT_BOX = """async ([data, width, height]) => {
  const { contentBox } = await import("./try.bars.js");
  const pixels = Uint8ClampedArray.from(atob(data), (letter) => letter.charCodeAt(0));
  const box = contentBox(pixels, width, height);
  return box && [box.left, box.top, box.right, box.bottom];
}"""

# The mean of each channel of the picture that is sent, and its size.
SENT = """() => {
  const canvas = document.getElementById("picture");
  const { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const mean = [0, 0, 0, 0];
  data.forEach((level, at) => mean[at % 4] += level / (width * height));
  return { mean: mean.slice(0, 3), width, height };
}"""

# Another page's picture comes as its address.
GIVE_ADDRESS = """(event) => {
  const data = new DataTransfer();
  data.setData("text/uri-list", "https://example.org/cat.jpg");
  const fields = { bubbles: true, cancelable: true, dataTransfer: data, clipboardData: data };
  const kind = event === "drop" ? DragEvent : ClipboardEvent;
  document.getElementById("stage").dispatchEvent(new kind(event, fields));
}"""

SHARE_A_CANVAS = """() => {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d");
  let at = 0;
  setInterval(() => {
    context.fillStyle = `rgb(${at++ % 250} 90 90)`;
    context.fillRect(0, 0, 300, 150);
  }, 50);
  const stream = canvas.captureStream(20);
  window.shared = stream.getVideoTracks()[0];
  navigator.mediaDevices.getDisplayMedia = async () => stream;
}"""

PICTURE_BOX = """() => {
  const { x, y, width, height } = document.getElementById("picture").getBoundingClientRect();
  return [x, y, width, height];
}"""

# All that the service sends of what its speaker plays.
HEAR = """async () => {
  const { sound } = await import("./hear.js");
  const take = sound.take.bind(sound);
  window.heard = [];
  sound.take = (piece) => {
    if (piece.start != null) heard.push(...piece.samples);
    take(piece);
  };
}"""
# All that was played since the last question is silence.
IS_SILENT = """() => {
  const played = heard.splice(0);
  return played.every((level) => Math.abs(level) < 0.001);
}"""
# Spots of the folded cloth: the best guess is paper, and fabric as the whole picture is.
UNLIKE, LIKE = (0.4, 0.8, "I cannot tell"), (0.7, 0.7, "fabric")
COUNT_PICTURES = """() => {
  const send = WebSocket.prototype.send;
  window.pictures = 0;
  WebSocket.prototype.send = function (data) {
    if (data.byteLength > 10_000) pictures += 1;
    send.call(this, data);
  };
}"""
# Events of the pointer in one task of the page, faster than any message of it.
QUICKLY = """(types) => {
  const canvas = document.getElementById("picture");
  const { x, y, width, height } = canvas.getBoundingClientRect();
  const at = { clientX: x + 0.4 * width, clientY: y + 0.8 * height, pointerId: 1, bubbles: true };
  for (const type of types) canvas.dispatchEvent(new PointerEvent(type, { ...at, button: 0 }));
}"""
# A camera that films a turning figure, and a screen that nobody is asked for.
CHROMIUM_FLAGS = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")


@pytest.fixture(scope="module", params=["service", "static"])
def where(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Service | str]:
    """The page as a service serves it, and as the files of `demo --static` on a plain host."""
    if request.param == "service":
        yield request.getfixturevalue("service")
        return
    folder = tmp_path_factory.mktemp("static")
    static_site.write(EXAMPLES, folder)
    with served(folder) as address:
        yield address


def level(service: Service) -> float:
    from conftest import status

    return float(status(service)["speaker"]["level"])


def until(is_felt: Callable[[], bool], move: Callable[[], None]) -> None:
    """Go on moving until it is felt; how many moves that takes depends on the machine."""
    gives_up_at = time.monotonic() + PATIENCE_MS / 1000
    while not is_felt():
        assert time.monotonic() < gives_up_at, "nothing is felt"
        move()


def until_felt(service: Service, move: Callable[[], None]) -> None:
    """Go on moving until the speaker plays."""
    until(lambda: level(service) > 0.0, move)


def rubbing(page: Page) -> Callable[[], None]:
    """Return the next move of a hand that rubs to and fro, the button held."""
    places = itertools.cycle(0.4 + 0.01 * np.abs(np.arange(-20, 20)))
    return lambda: at(page, float(next(places)), 0.8)


def test_a_picture_is_looked_at_when_it_comes_and_felt_when_it_is_pressed(browser, service):
    with visit(browser, service) as page:
        sample(page)
        expect(page.locator("#material")).to_have_text("Nothing touched yet")
        at(page, 0.5, 0.8)
        page.mouse.down()
        expect(page.locator("#because")).to_contain_text("encoder")
        expect(page.locator("#feels")).to_have_text(
            re.compile(r"^(\w+, )?\w+, (rings|knocks|soft)$")
        )
        expect(page.locator("#answer > p")).not_to_contain_text(["%"] * 3)
        expect(page.locator("#because")).to_contain_text("under the hand")
        until_felt(service, rubbing(page))
        page.mouse.up()


@pytest.mark.nightly
def test_a_thing_on_a_plain_ground_is_outlined_as_recognise_outlines_it(browser, service, tmp_path):
    picture = tmp_path / "thing.png"
    Image.fromarray(drawn("thing")[0]).save(picture)
    with visit(browser, service) as page:
        page.locator("#file").set_input_files(str(picture))
        command = [sys.executable, "-m", "hapticvlm", "recognise", "--json", str(picture)]
        told = json.loads(subprocess.check_output(command))
        assert told["outlined"]
        expect(page.locator("#because")).to_contain_text("outlined on its plain ground")
        material = told["runner_up"] if told["material"] == "unknown" else told["material"]
        expect(page.locator("#answer")).to_contain_text(material)
        page.wait_for_function(SURE, arg=[100 * told["confidence"], 6])  # encoded as JPEG


@pytest.mark.nightly
def test_the_page_outlines_what_the_service_outlines(browser, service):
    side = plain_ground.SIDE
    with visit(browser, service) as page:
        for name in GROUNDS:
            small = Image.fromarray(drawn(name)[0]).resize((side, side * 3 // 4))
            pixels = base64.b64encode(small.convert("RGBA").tobytes()).decode()
            there = page.evaluate(OUTLINE, [pixels, *small.size])
            here = plain_ground.outline(np.asarray(small))
            assert there == (None if here is None else here.astype(int).ravel().tolist()), name


def conventions() -> dict[str, Image.Image]:
    """A smooth picture as files state it otherwise: with bars, alpha and a profile of its own."""
    levels = np.mgrid[0:120, 0:160].sum(axis=0) % 200
    image = Image.fromarray(np.stack([levels + 30, levels, 255 - levels], 2).astype(np.uint8))
    barred, cut, profiled = Image.new("RGB", (160, 220)), image.copy(), image.copy()
    profiled.info["icc_profile"] = profile_with_red_and_green_swapped()
    barred.paste(image, (0, 50))
    pillars = Image.new("RGB", (260, 120), (40, 40, 40))
    pillars.paste(image, (50, 0))
    clear, half = image.copy(), image.copy()
    clear.putalpha(0)
    half.putalpha(Image.fromarray(np.where(levels < 100, 255, 0).astype(np.uint8)))
    cut.paste((0, 0, 0), (0, 0, 160, 40))  # a bar on one side is part of the picture
    barless = {"plain": image, "one bar": cut, "profile": profiled}
    return {"bars": barred, "pillars": pillars, "alpha of 0": clear, "alpha": half} | barless


def test_bars_alpha_and_profile_of_a_picture_count_as_recognise_counts_them(
    browser, service, tmp_path
):
    with visit(browser, service) as page:
        expect(page.locator("#pane")).to_have_attribute("data-picture", "1")
        for name, image in conventions().items():
            rgb = image.convert("RGBA")
            asked = [base64.b64encode(rgb.tobytes()).decode(), *rgb.size]
            box = content_box(np.asarray(rgb.convert("RGB")))
            assert page.evaluate(CONTENT_BOX, asked) == (None if box is None else list(box)), name

            file = tmp_path / f"{name}.png"
            image.save(file)
            frame = read_frame(file)
            pixels = np.frombuffer(frame.image, np.uint8).reshape(-1, 3)
            before = str(page.locator("#pane").get_attribute("data-picture"))
            page.locator("#file").set_input_files(str(file))
            expect(page.locator("#pane")).not_to_have_attribute("data-picture", before)
            sent = page.evaluate(SENT)
            assert (sent["width"], sent["height"]) == (frame.width, frame.height), name
            assert sent["mean"] == pytest.approx(pixels.mean(axis=0), abs=2.0), name


@pytest.mark.nightly
def test_a_dropped_picture_is_taken_and_what_is_none_is_said(browser, service):
    with visit(browser, service) as page:
        expect(page.locator("#pane")).to_have_attribute("data-picture", "1")
        file = io.BytesIO()
        rough = np.random.default_rng(1).integers(0, 255, (300, 400, 3), np.uint8)
        Image.fromarray(rough).save(file, "PNG")
        with next_picture(page):
            page.evaluate(DROP, ["mine.png", base64.b64encode(file.getvalue()).decode()])
        page.evaluate(DROP, ["notes.txt", base64.b64encode(b"hello").decode()])
        expect(page.locator("#told")).to_contain_text("notes.txt is not a picture")
        for event in ("drop", "paste"):
            page.evaluate("document.getElementById('told').textContent = ''")
            page.evaluate(GIVE_ADDRESS, event)
            expect(page.locator("#told")).to_contain_text("save the picture")


@pytest.mark.nightly
def test_a_shared_window_that_gives_no_picture_is_told_until_it_does(browser, service):
    with visit(browser, service) as page:
        page.evaluate(SHARE_A_CANVAS)
        with next_picture(page):
            page.locator("#screen").click()
        page.evaluate("shared.dispatchEvent(new Event('mute'))")
        expect(page.locator("#told")).to_contain_text("minimised")
        page.evaluate("shared.dispatchEvent(new Event('unmute'))")
        expect(page.locator("#told")).to_have_text("")


def test_a_new_picture_shows_no_card_until_it_is_pointed_at_and_a_person_is_not_felt(
    browser, service
):
    with visit(browser, service) as page:
        sample(page)
        at(page, 0.5, 0.8)
        expect(page.locator("#card")).to_be_visible()
        with next_picture(page):  # the pointer still lies over the picture
            page.locator("#file").set_input_files(get_sample_data("grace_hopper.jpg", False))
        expect(page.locator("#card")).to_be_hidden()

        at(page, 0.5, 0.3)
        page.mouse.down()
        expect(page.locator("#material")).to_have_text("I do not feel people or animals")
        expect(page.locator("#motion")).to_have_text("nothing to feel here")
        expect(page.locator("#because dd").first).to_contain_text("a person or an animal")


def test_a_wrong_answer_is_corrected_by_a_choice_that_stays(browser, service):
    with visit(browser, service) as page:
        sample(page, "carafe")
        at(page, 0.3, 0.3)
        page.mouse.down()
        page.mouse.up()
        page.get_by_text("Not right?").click()  # on the way the pointer crosses other things
        page.locator("#correct-material").select_option("rubber")
        expect(page.locator("#material")).to_have_text("rubber")
        expect(page.locator("#sure")).to_contain_text("stated by you")
        at(page, 0.3, 0.3)
        expect(page.locator("#material")).to_have_text("rubber")


def test_an_uncertain_spot_takes_the_pictures_word_only_where_its_own_best_guess_agrees(
    browser, service
):
    with visit(browser, service) as page:
        sample(page, "cloth")
        page.evaluate(COUNT_PICTURES)
        # The second spot is answered after all that was asked about the first.
        for x, y, word in (UNLIKE, LIKE, UNLIKE):
            at(page, x, y, steps=1)
            expect(page.locator("#material")).to_have_text(word)
        assert page.evaluate("pictures") == 3  # both spots, and the whole picture for one of them


@pytest.mark.parametrize(("wide", "high"), nightly_except(2, [(1280, 900), (900, 700), (400, 800)]))
def test_the_picture_fills_the_window_and_stays_whatever_is_said(browser, service, wide, high):
    """A picture that grew or shrank under a resting hand would be touched elsewhere."""
    with visit(browser, service, size=(wide, high)) as page:
        sample(page, "carafe")

        def box() -> list[float]:
            return list(page.evaluate(PICTURE_BOX))

        before = box()
        width, height = page.evaluate("[stage.clientWidth, stage.clientHeight]")
        assert height > (0.5 if wide == 400 else 0.74) * high
        assert min(width - before[2], height - before[3]) < 1
        assert before[1] + before[3] <= page.evaluate("bar.getBoundingClientRect().top")
        # New places are crossed, whose materials are not known yet.
        for x, y in ((0.3, 0.3), (0.9, 0.1), (0.7, 0.9), (0.1, 0.6), (0.3, 0.3)):
            at(page, x, y)
            assert box() == before
        page.mouse.down()
        until(page.locator("#save").is_visible, rubbing(page))
        assert box() == before
        at(page, 0.3, 0.3)
        page.mouse.up()
        page.get_by_text("Not right?").click()
        page.locator("#correct-material").select_option("rubber")
        expect(page.locator("#corrected")).to_contain_text("Corrected to rubber")
        assert box() == before
        page.get_by_text("Settings").click()
        assert box() == before
        thumbnails = page.locator("#samples").bounding_box()
        assert thumbnails is None or thumbnails["y"] >= page.evaluate("stage.clientHeight")


@pytest.mark.nightly
def test_one_of_the_four_likeliest_corrects_it_by_one_press(browser, service):
    with visit(browser, service) as page:
        sample(page)
        at(page, 0.5, 0.8)
        page.mouse.down()
        page.mouse.up()
        page.get_by_text("Not right?").click()
        named = page.locator("#likeliest button")
        expect(named).to_have_count(4)
        last = named.last.inner_text()
        named.last.click()
        expect(page.locator("#material")).to_have_text(last)


@pytest.mark.nightly
def test_where_a_phone_can_open_it_is_said(browser, service):
    with visit(browser, service) as page:
        page.get_by_text("Feel it on your phone").click()
        expect(page.locator("#reach-said")).to_contain_text("hapticvlm serve --lan")


@pytest.mark.nightly
def test_a_phones_camera_reads_the_address_of_this_very_page(browser):
    token = "a-token-long-enough"
    options = ["--host", "0.0.0.0", "--token", token, "--pages-from", "lan"]
    with running(options) as own, visit(browser, own, hash_=f"#token={token}") as page:
        page.get_by_text("Feel it on your phone").click()
        read = read_from_page(page)
        port = own.page.rsplit(":", 1)[1].strip("/")
        assert re.fullmatch(rf"http://[^/]+:{port}/try", read)
        assert f"ws://{read[7:].removesuffix('try')} with" in page.inner_text("#reach-said")


@pytest.mark.nightly
@pytest.mark.parametrize("source", ["screen", "camera"])
def test_a_live_source_is_looked_at_and_felt_until_it_is_ended(browser, service, source):
    with visit(browser, service) as page:
        expect(page.locator("#pane")).to_have_attribute("data-picture", "1")
        page.locator(f"#{source}").click()
        # The hand points at the picture that is shown, not at one that comes later.
        expect(page.locator("#pane")).not_to_have_attribute("data-picture", "1")
        expect(page.locator(f"#{source}")).to_have_attribute("aria-pressed", "true")
        expect(page.locator("#material")).to_have_text("Nothing touched yet")
        at(page, 0.5, 0.5)
        expect(page.locator("#because")).to_contain_text("the part under the hand")
        page.mouse.down()
        until_felt(service, rubbing(page))
        page.mouse.up()
        page.locator(f"#{source}").click()
        expect(page.locator(f"#{source}")).to_have_attribute("aria-pressed", "false")


def press(page: Page) -> None:
    page.mouse.down()
    page.wait_for_timeout(300)
    page.mouse.up()
    page.wait_for_timeout(150)


@pytest.mark.nightly
def test_the_wooden_and_the_metal_half_of_one_picture_sound_different(browser, service):
    halves = [
        Image.open(path).resize((400, 400))
        for path in (Path(__file__).parent / "wooden_box.jpg", PAGES / "try.kettle.jpg")
    ]
    both = Image.new("RGB", (800, 400))
    for place, half in enumerate(halves):
        both.paste(half, (400 * place, 0))
    file = io.BytesIO()
    both.save(file, "PNG")
    heard = {}
    with visit(browser, service) as page:
        page.get_by_text("Settings").click()
        page.locator("#among").select_option("four")
        page.evaluate(HEAR)
        with next_picture(page):
            page.evaluate(DROP, ["both.png", base64.b64encode(file.getvalue()).decode()])
        for material, x in (("wood", 0.25), ("metal", 0.75)):
            at(page, x, 0.5)
            expect(page.locator(".word")).to_contain_text(material)
            page.evaluate("() => { heard.length = 0; }")
            for _ in range(3):
                press(page)
            until(lambda: bool(np.any(page.evaluate("heard"))), lambda: press(page))
            heard[material] = np.array(page.evaluate("heard"))
    shapes = []
    for wave in heard.values():
        power = np.abs(np.fft.rfft(wave, 1 << 16)) ** 2
        bands = np.add.reduceat(power[: 1 << 15], np.arange(0, 1 << 15, 256))
        shapes.append(np.sqrt(bands / bands.sum()))
    assert float(shapes[0] @ shapes[1]) < 0.9  # 1 is the same spectrum


@pytest.mark.nightly
def test_what_a_scene_can_be_made_of_is_asked_for_and_holds(browser, service):
    with visit(browser, service) as page:
        page.get_by_text("Settings").click()
        page.locator("#among").select_option("four")
        sample(page)
        four = re.compile(r"^(wood|glass|fabric|metal|I cannot tell)$")
        for x in (0.3, 0.5, 0.7):
            at(page, x, 0.5)
            expect(page.locator("#material")).to_have_text(four)


def test_the_things_of_the_first_picture_are_outlined_and_labelled_by_us(browser, where):
    with visit(browser, where) as page:
        expect(page.locator("#pane")).to_have_attribute("data-looked", "1")
        expect(page.locator("#material")).to_have_text("Nothing touched yet")
        expect(page.locator("#correct")).to_be_hidden()
        outlines = set()
        for x, y, material in ((0.41, 0.38, "metal"), (0.62, 0.3, "glass"), (0.3, 0.9, "wood")):
            at(page, x, y)
            expect(page.locator("#material")).to_have_text(material)
            expect(page.locator("#sure")).to_have_text("labelled by us")
            expect(page.locator("#region")).to_be_hidden()
            outlines.add(page.locator("#lit").get_attribute("points"))
            page.mouse.down()
            fill = "none" if material == "wood" else re.compile("rgba")  # things lie on the table
            expect(page.locator("#lit")).to_have_css("fill", fill)
            page.mouse.up()
        assert len(outlines - {""}) == 3
        page.get_by_text("Not right?").click()
        page.locator("#correct-material").select_option("rubber")
        expect(page.locator("#sure")).to_have_text("stated by you")
        page.get_by_role("button", name="Take it back").click()
        expect(page.locator("#material")).to_have_text("wood")


def test_a_drawn_hand_touches_the_first_picture_once_and_its_answer_is_at_the_finger(
    browser, service
):
    with visit(browser, service, slowed=3, reduced_motion="no-preference") as page:
        expect(page.locator("#shown-hand")).to_be_visible()
        expect(page.locator("#region")).to_have_attribute("data-hand", "held")
        expect(page.locator("#card")).to_be_visible()
        expect(page.locator("#motion")).to_contain_text("slide")
        until_felt(service, lambda: page.wait_for_timeout(20))
        expect(page.locator("#shown-hand")).to_be_hidden()
        expect(page.locator("#region")).to_have_attribute("data-hand", "away")
        sample(page)
        expect(page.locator("#shown-hand")).to_be_hidden()


@pytest.mark.nightly
def test_a_persons_hand_ends_the_drawn_one(browser, service):
    with visit(browser, service, slowed=50, reduced_motion="no-preference") as page:
        expect(page.locator("#shown-hand")).to_be_visible()
        at(page, 0.2, 0.8)
        expect(page.locator("#shown-hand")).to_be_hidden()
        expect(page.locator("#region")).to_have_attribute("data-hand", "near")


def near(page: Page, selector: str, x: float, y: float) -> float:
    """Return how far an element is from a point of the picture, px."""
    box, pane = page.locator(selector).bounding_box(), page.locator("#picture").bounding_box()
    assert box is not None
    assert pane is not None
    away_x, away_y = pane["x"] + x * pane["width"], pane["y"] + y * pane["height"]
    across = max(box["x"] - away_x, 0, away_x - box["x"] - box["width"])
    down = max(box["y"] - away_y, 0, away_y - box["y"] - box["height"])
    return float(np.hypot(across, down))


def test_the_word_is_beside_the_finger_and_covers_nothing_under_it(browser, where):
    with visit(browser, where) as page:
        for x, y in ((0.03, 0.05), (0.5, 0.5), (0.97, 0.95)):
            at(page, x, y)
            page.mouse.down()
            expect(page.locator("#card")).to_be_visible()
            page.wait_for_function("() => document.getElementById('card').style.transform !== ''")
            assert 10 < near(page, "#card", x, y) < 140
            page.mouse.up()


@contextmanager
def stopped_while_pressed(browser: Browser, service: Service) -> Iterator[Page]:
    """Press on a picture, and press Escape."""
    with visit(browser, service) as page:
        sample(page)
        at(page, 0.5, 0.8)
        page.mouse.down()
        page.keyboard.press("Escape")
        expect(page.locator("#stopped")).to_contain_text("Stopped at")
        yield page


def test_escape_stops_and_a_new_press_is_felt_again(browser, service):
    with stopped_while_pressed(browser, service) as page:
        page.evaluate(QUICKLY, ["pointerup", "pointerdown"])
        until_felt(service, rubbing(page))
        expect(page.locator("#stopped")).to_be_empty()


def test_the_first_press_is_felt_where_a_visitor_before_stopped_and_left(browser, service):
    with stopped_while_pressed(browser, service):
        pass
    with visit(browser, service) as page:
        sample(page)
        at(page, 0.5, 0.8)
        page.mouse.down()
        until_felt(service, rubbing(page))


def test_a_tap_between_two_messages_of_the_page_is_felt(browser, service):
    with visit(browser, service) as page:
        page.evaluate(HEAR)
        sample(page)
        at(page, 0.5, 0.8)
        page.mouse.down()  # a pointer that the browser lets a page capture
        until_felt(service, rubbing(page))
        page.mouse.up()
        until(lambda: page.evaluate(IS_SILENT), lambda: page.wait_for_timeout(300))

        def tap() -> None:  # more than once, as the first place may not be recognised yet
            page.evaluate(QUICKLY, ["pointerdown", "pointerup"])
            page.wait_for_timeout(300)

        until(lambda: not page.evaluate(IS_SILENT), tap)


@pytest.mark.nightly
def test_the_keyboard_alone_is_enough(browser, service):
    with visit(browser, service) as page:
        with next_picture(page):
            page.locator("#samples button").first.focus()
            page.keyboard.press("Enter")
        page.locator("#picture").focus()
        page.keyboard.down(" ")
        keys = itertools.cycle(("ArrowRight", "ArrowLeft"))
        until_felt(service, lambda: page.keyboard.press(next(keys)))
        page.keyboard.up(" ")


def test_another_scene_that_owns_the_outputs_is_named_and_left_in_peace(browser, service):
    with visit(browser, service) as first, visit(browser, service) as second:
        expect(first.locator("#plays")).to_contain_text("Your device")
        expect(second.locator("#plays")).to_contain_text("Another scene owns the outputs")
        expect(second.locator("#take")).to_be_visible()


SIZES = {"screen": (1280, 900), "phone": (390, 844)}


@pytest.mark.nightly
@pytest.mark.parametrize("screen", SIZES)
def test_it_is_open_to_everybody_and_fits_a_phone(browser, where, screen):
    with visit(browser, where, SIZES[screen]) as page:
        sample(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.evaluate(AXE.read_text(encoding="utf-8"))
        found = page.evaluate("axe.run()")["violations"]
        assert [violation["id"] for violation in found] == []
