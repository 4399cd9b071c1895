"""The A-Frame scene of one file, in a real headless Chromium, with an emulated headset (iwer)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import msgpack
import pytest
from pace import PACE
from playwright.sync_api import Page
from webxr_scene import EXAMPLES, served

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.browser,
    pytest.mark.needs_toolchain("chromium", "aframe"),
]

MODULES = EXAMPLES / "webxr" / "node_modules"
HEADSET = """
  window.headset = new IWER.XRDevice(IWER.metaQuest3, {stereoEnabled: true});
  headset.installRuntime({forceInstall: true});
"""
# Where a thing is drawn, in shares of the page.
PLACE = """(name) => {
  const at = new AFRAME.THREE.Vector3();
  document.querySelector(`[data-name=${name}]`).object3D.getWorldPosition(at);
  at.project(document.querySelector('a-scene').camera);
  return [(at.x + 1) / 2, (1 - at.y) / 2];
}"""
HOLD = """(name) => {
  const {x, y, z} = document.querySelector(`[data-name=${name}]`).object3D.position;
  headset.controllers.right.position.set(x, y, z);
}"""
# Lists a second source of the right hand, which is where the left controller is.
SECOND = """() => {
  const shown = Object.getOwnPropertyDescriptor(XRSession.prototype, 'inputSources');
  Object.defineProperty(XRSession.prototype, 'inputSources', {get() {
    const sources = [...shown.get.call(this)];
    const {targetRaySpace} = sources.find(({handedness}) => handedness === 'left');
    this.second ??= {handedness: 'right', targetRaySpace};
    return [...sources.filter(({handedness}) => handedness === 'right'), this.second];
  }});
}"""


@dataclass
class Visit:
    """The page, what went through its WebSocket and what it complained of."""

    page: Page
    heard: list[Any] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    sent: list[Any] = field(default_factory=list)

    def watch(self, socket: Any) -> None:
        socket.on("framesent", lambda data: self.sent.append(msgpack.unpackb(data)))
        socket.on("framereceived", lambda data: self.heard.append(msgpack.unpackb(data)))

    def hear(self, said: Any) -> None:
        if said.type == "error":
            self.complaints.append(said.text)

    def felt(self, since: int) -> float:
        """Return the strongest vibration since so many messages."""
        plans = [one for one in self.heard[since:] if one["type"] == "vibration"]
        return max((value for plan in plans for value in plan.get("amplitude", ())), default=0.0)

    def until(self, claim: Callable[..., bool], *given: Any) -> None:
        """Let the page go on until the claim holds."""
        gives_up_at = time.monotonic() + 60.0 * PACE
        while not claim(*given):
            assert time.monotonic() < gives_up_at, "it never happened"
            self.page.wait_for_timeout(20)

    def phases(self, since: int) -> list[str]:
        """Return the phases of the touches since so many messages were sent."""
        return [one["phase"] for one in self.sent[since:] if one["type"] == "touch"]

    def rests(self, since: int) -> bool:
        """Return whether the last vibration since so many messages is none."""
        plans = [one for one in self.heard[since:] if one["type"] == "vibration"]
        return bool(plans) and "amplitude" not in plans[-1]


@pytest.fixture(scope="module")
def visit() -> Iterator[Visit]:
    with served((240, 180)) as (service, page):
        page.add_init_script(path=MODULES / "iwer" / "build" / "iwer.min.js")
        page.add_init_script(HEADSET)
        visit = Visit(page)
        page.on("websocket", visit.watch)
        page.on("console", visit.hear)
        page.on("pageerror", lambda error: visit.complaints.append(str(error)))
        page.goto(f"{service.page}scene/webxr/aframe.html")
        page.locator("#said", has_text="Connected").wait_for()
        yield visit


def test_a_thing_pressed_with_the_mouse_is_decided_by_its_name_and_felt(visit: Visit) -> None:
    since = len(visit.heard)
    x, y = visit.page.evaluate(PLACE, "SteelBlock")
    visit.page.mouse.move(240 * x, 180 * y)
    visit.page.mouse.down()
    visit.page.locator("#said", has_text="SteelBlock is metal").wait_for()
    visit.until(lambda: visit.felt(since) >= 0.1)
    visit.page.mouse.up()
    visit.until(lambda: visit.rests(since))  # so that no later press is taken to be felt by it


def test_a_model_of_gltf_is_felt_as_its_touched_material_and_other_things_go_on(
    visit: Visit,
) -> None:
    def stool() -> list[str]:
        scenes = [one["objects"] for one in visit.sent if one["type"] == "scene"]
        [model] = [each for each in scenes[-1] if each["object_id"] == "Stool"]
        return [surface["name"] for surface in model.get("surfaces", ())]

    visit.until(lambda: bool(stool()))
    assert stool() == ["Oak.Seat", "Steel.Legs"]
    for name, above in (("Stool", 0.02), ("SteelBlock", 0.0)):  # its seat, 5 cm above its origin
        since, sent = len(visit.heard), len(visit.sent)
        x, y = visit.page.evaluate(PLACE, name)
        visit.page.mouse.move(240 * x, 180 * (y - above))
        visit.page.mouse.down()
        visit.until(lambda begin: visit.felt(begin) >= 0.1, since)
        visit.page.mouse.up()
        visit.until(lambda begin: visit.phases(begin)[-1:] == ["release"], sent)
        visit.until(lambda begin: visit.rests(begin), since)
        touches = [one for one in visit.sent[sent:] if one["type"] == "touch"]
        assert {(one.get("object_id", name), one.get("surface", 0)) for one in touches} == {
            (name, 0)
        }, touches
    visit.until(
        lambda: any(
            one.get("object_id") == "Stool" for one in visit.heard if one["type"] == "decision"
        )
    )
    decided = {
        one["object_id"]: one["material"] for one in visit.heard if one["type"] == "decision"
    }
    assert decided["Stool"] == "wood"


def test_what_is_said_lies_above_the_picture(visit: Visit) -> None:
    box = visit.page.locator("#said").bounding_box()
    assert box is not None
    place = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
    assert visit.page.evaluate("([x, y]) => document.elementFromPoint(x, y).id", place) == "said"


def test_a_controller_in_a_thing_feels_it_and_rests_when_it_leaves(visit: Visit) -> None:
    visit.page.evaluate("document.querySelector('a-scene').enterVR()")
    since, sent = len(visit.heard), len(visit.sent)
    visit.page.evaluate(HOLD, "VelvetCushion")
    visit.page.locator("#said", has_text="VelvetCushion is fabric").wait_for()
    visit.until(lambda: visit.felt(since) >= 0.1)
    visit.page.evaluate("headset.controllers.right.position.set(0.4, 1.4, 0)")
    visit.until(lambda: visit.phases(sent)[-1:] == ["release"])
    visit.until(lambda: visit.rests(since))  # of a starved page the lease may have lapsed before


def test_a_second_source_of_the_hand_neither_strikes_again_nor_lets_go(visit: Visit) -> None:
    visit.page.evaluate(SECOND)
    since = len(visit.sent)
    visit.page.evaluate(HOLD, "GlassBall")
    visit.page.locator("#said", has_text="GlassBall is glass").wait_for()
    visit.until(lambda: visit.phases(since).count("slide") > 10)
    phases = visit.phases(since)
    assert phases.count("contact") == 1
    assert "release" not in phases
    visit.page.evaluate("headset.controllers.right.position.set(0.4, 1.4, 0)")
    visit.until(lambda: visit.phases(since)[-1] == "release")


def test_nothing_was_refused_and_nothing_went_wrong(visit: Visit) -> None:
    assert [one for one in visit.heard if one["type"] == "error"] == []
    assert visit.complaints == []
