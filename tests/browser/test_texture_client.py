"""The web client's texture maps, in a real Chromium on a real service: hashed, sent and decided."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from drawn_textures import planks, weave
from playwright.sync_api import Browser, Page
from webxr_scene import EXAMPLES, PATIENCE_MS, SLOW_MS

from hapticvlm.client.local_service import running
from hapticvlm.vision.pictures import Pixels

pytestmark = [pytest.mark.browser, pytest.mark.needs_toolchain("chromium", "@msgpack/msgpack")]

PAGE = """<!doctype html><title>textures</title>
<script type="importmap">{"imports": {"hapticvlm": "./client/index.js",
"@msgpack/msgpack": "./node_modules/@msgpack/msgpack/dist.esm/index.mjs"}}</script>
<script type="module">
  import {Haptics, Textures} from 'hapticvlm';
  window.haptics = new Haptics(`ws://${location.host}/`);
  window.textures = new Textures();
  textures.follow(haptics);
  window.decisions = new Map();
  haptics.addEventListener('decision', ({detail}) => decisions.set(detail.surface, detail));
</script>"""
# Waits in the page: its content security policy forbids what playwright waits with.
WHEN = """async (patience) => {
  const end = performance.now() + patience;
  while (!(%s) && performance.now() < end) await new Promise((done) => setTimeout(done, 50));
}"""
# States a mesh of surfaces, of which the second tells its material by its name.
STATE = """(maps) => {
  const images = maps.map(([side, text]) => {
    const data = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return {data, width: side, height: side};
  });
  const [boards, cloth] = images.map((image) => textures.name(image));
  window.named = {boards, cloth, again: textures.name(images[0])};
  const surfaces = [
    {name: 'mat14', texture: boards}, {name: 'Oak_Floor', texture: 'f'.repeat(32)},
    {name: 'mat15', texture: cloth},
  ];
  haptics.scene([{object_id: 'room', name: 'mesh2057757694', surfaces}]);
  return named;
}"""

# Ten events of telemetry later a second request would have been answered.
STATED_AGAIN = """() => new Promise((done) => {
  let count = 0;
  haptics.addEventListener('telemetry', () => ++count === 10 && done());
  haptics.state({object_id: 'room'});
})"""


def rgba(pixels: Pixels) -> list[Any]:
    """Return side and pixels of a map, four bytes each, as base64."""
    alpha = np.full((*pixels.shape[:2], 1), 255, np.uint8)
    data = np.concatenate([pixels, alpha], axis=2).tobytes()
    return [pixels.shape[0], base64.b64encode(data).decode()]


@pytest.fixture
def page(tmp_path: Path, browser: Browser) -> Iterator[Page]:
    """Open a page of a scene folder with the web client in it, served by the service."""
    # Copied, since the service serves no link that leads out of a folder. Chromium lets only a page
    # that comes from this machine connect to it, so the page is a file as well.
    shutil.copytree(EXAMPLES / "webxr" / "client", tmp_path / "client")
    codec = Path("node_modules/@msgpack/msgpack/dist.esm")
    shutil.copytree(EXAMPLES / "webxr" / codec, tmp_path / codec)
    (tmp_path / "index.html").write_text(PAGE)
    with running(["--scene", str(tmp_path)]) as service:
        page = browser.new_page()
        page.set_default_timeout(SLOW_MS)
        page.goto(f"{service.page}scene/index.html")
        yield page
        page.close()


def test_maps_that_neither_name_nor_shader_tells_are_sent_once_and_decide(page: Page) -> None:
    sent: list[Any] = []
    page.on("websocket", lambda socket: watch(socket, sent))
    page.goto(page.url)
    page.evaluate(WHEN % "window.haptics?.isOwner", PATIENCE_MS)
    named = page.evaluate(STATE, [rgba(planks(512)), rgba(weave())])
    assert named["boards"] == named["again"] != named["cloth"]
    assert all(len(text) == 32 for text in named.values())
    page.evaluate(WHEN % "decisions.size === 2", PATIENCE_MS)
    boards, cloth = page.evaluate("[decisions.get(0), decisions.get(2)]")
    assert (boards["material"], boards["source"]) == ("wood", "texture")
    assert (cloth["material"], cloth["source"]) == ("fabric", "texture")
    frames = [message for message in sent if message["type"] == "frame"]
    assert [(frame["purpose"], frame["surface"]) for frame in frames] == [
        ("texture", 0),
        ("texture", 2),
    ]
    assert all(max(frame["width"], frame["height"]) == 256 for frame in frames)
    page.evaluate(STATED_AGAIN)
    assert len([message for message in sent if message["type"] == "frame"]) == 2


def watch(socket: Any, sent: list[Any]) -> None:
    socket.on("framesent", lambda data: sent.append(msgpack.unpackb(data)))
