"""The page of docs/tutorials/web.md, copied from the tutorial into a folder, in real Chromium.

The folder has three.js and the client, as the first step of the tutorial installs them.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from textwrap import dedent
from typing import Any

import msgpack
import pytest
from lan_address import TOKEN, own_address
from webxr_scene import EXAMPLES, served

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.browser,
    pytest.mark.needs_toolchain("chromium", "three"),
]

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorials" / "web.md"
MODULES = EXAMPLES / "webxr" / "node_modules"
WIDTH, HEIGHT = 400, 300


@pytest.fixture
def boxes(tmp_path: Path) -> Path:
    """Return a folder with the page and the packages that it imports."""
    (page,) = re.findall(r"```html\n(.*?)```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "index.html").write_text(dedent(f"   {page}"), encoding="utf-8")
    packages = tmp_path / "node_modules"
    shutil.copytree(MODULES / "three" / "build", packages / "three" / "build")
    shutil.copytree(MODULES / "@msgpack", packages / "@msgpack")
    shutil.copytree(EXAMPLES / "webxr" / "client", packages / "hapticvlm")
    return tmp_path


def test_a_box_under_the_pressed_pointer_is_felt_as_its_name_says(boxes: Path) -> None:
    sent: list[Any] = []
    complaints: list[str] = []
    with served((WIDTH, HEIGHT), boxes) as (service, page):
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "websocket",
            lambda socket: socket.on("framesent", lambda data: sent.append(msgpack.unpackb(data))),
        )
        page.goto(f"{service.page}scene/")
        said = page.locator("#said")
        said.get_by_text("Press on a box").wait_for()
        for x, words in ((0.25, "OakTable: wood"), (0.5, "SteelBlock: metal")):
            page.mouse.move(WIDTH * x, HEIGHT / 2)
            page.mouse.down()
            page.mouse.move(WIDTH * x + 5, HEIGHT / 2)
            page.get_by_text(words).wait_for()
            page.mouse.up()
    touches = [one for one in sent if one["type"] == "touch"]
    assert {one["object_id"] for one in touches if one["phase"] == "contact"} == {
        "OakTable",
        "SteelBlock",
    }
    assert complaints == []


def test_on_a_phone_the_password_of_the_page_lets_its_scene_in_and_a_finger_rubs(
    boxes: Path,
) -> None:
    width, height = 390, 844
    with served((width, height), boxes, token=TOKEN) as (service, page):
        page.goto(f"{service.page.replace('0.0.0.0', own_address())}scene/")
        page.locator("#said").get_by_text("Press on a box").wait_for()
        page.evaluate("addEventListener('pointercancel', () => { document.title = 'cancelled'; })")
        finger = page.context.new_cdp_session(page)
        for turn in range(10):
            point = {"x": 0.17 * width, "y": height / 2 + 4 * turn}
            event = {"type": "touchMove" if turn else "touchStart", "touchPoints": [point]}
            finger.send("Input.dispatchTouchEvent", event)
            page.get_by_text("OakTable: wood").wait_for()
        assert page.title() == "Three boxes"
