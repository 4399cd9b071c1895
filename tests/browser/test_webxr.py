"""The WebXR example in a real headless Chromium, with an emulated headset, against the service."""

import base64
import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pace import PACE
from PIL import Image
from webxr_frames import LOOK
from webxr_scene import Visit, visiting

three = pytest.mark.needs_toolchain("chromium", "three")
pytestmark = [pytest.mark.nightly, pytest.mark.browser, three]

LOOK_MS = 10_000 * PACE  # to draw, send and look at a picture
NEUTRAL_C = 32.0
FRAMES_ONLY = ("bowl", "vase", "linen", "kettle")
HEAD = (0.1, 1.4, 0.5)
HOLD_BEFORE = """async ({main, three, session}, [key, x, y, z]) => {
  const {root} = main.objects.find((one) => one.key === key);
  const middle = new three.Box3().setFromObject(root).getCenter(new three.Vector3());
  middle.lerp({x, y, z}, 0.5);
  main.headset.controllers.right.position.set(middle.x, middle.y, middle.z);
  for (let i = 0; i < 3; i++) await new Promise((drawn) => session.requestAnimationFrame(drawn));
}"""


@pytest.fixture(scope="module")
def visit() -> Iterator[Visit]:
    """One visit shared by all tests: loading the page is what takes longest."""
    with visiting() as visit:
        yield visit


def test_the_table_holds_all_four_materials_and_things_of_two(visit: Visit) -> None:
    truths = visit.truths()
    assert set(truths.values()) == {"wood", "glass", "fabric", "metal"}
    assert truths["hammer head"] != truths["hammer handle"]


def test_every_object_touched_has_its_true_material_by_what_the_scene_says(visit: Visit) -> None:
    truths = visit.truths()
    decided = {key: visit.touch(key) or {"material": "none"} for key in truths}
    assert {key: decision["material"] for key, decision in decided.items()} == truths
    assert {decision["source"] for decision in decided.values()} == {"scene", "name", "shader"}
    assert all(decision["pattern"] for decision in decided.values())


def test_held_metal_draws_the_plate_to_the_setpoint_of_its_decision(visit: Visit) -> None:
    decision = visit.touch("kettle", feels_plate=True)
    assert decision["setpoint_c"] < NEUTRAL_C - 2
    assert decision["setpoint_c"] - 0.1 <= decision["plate"]["setpoint_c"] < NEUTRAL_C - 1


def test_the_panel_says_what_was_decided_and_why(visit: Visit) -> None:
    visit.touch("vase")
    visit.page.locator("#drawer").evaluate("drawer => (drawer.hidden = false)")
    visit.page.locator("#touched", has_text="vase").wait_for()
    visit.page.locator("#why", has_text="glass").wait_for()
    told = visit.page.inner_text("#why")
    for part in ("decided by\nname", "name: glass", "(default)", "setpoint", "plate"):
        assert part in told


def seen(visit: Visit, key: str) -> tuple[Any, Any]:
    """Take a picture of an object: (448, 448) grey levels and mask."""
    frame = visit.modules.evaluate(LOOK, [key, *HEAD])
    assert (frame["height"], frame["width"]) == (448, 448)
    image, mask = (
        np.asarray(Image.open(io.BytesIO(base64.b64decode(frame[name]))).convert("L"))
        for name in ("image", "mask")
    )
    return image, mask


@pytest.mark.parametrize("key", ["hammer head", "bottle"])
def test_a_picture_is_turned_to_its_object_and_filled_by_it(visit: Visit, key: str) -> None:
    image, mask = seen(visit, key)
    rows, columns = np.nonzero(mask)
    assert image.shape == mask.shape == (448, 448)
    assert max(np.ptp(rows), np.ptp(columns)) > 448 / 2
    assert abs(rows.mean() - 224) < 80
    assert abs(columns.mean() - 224) < 80
    assert image[mask > 0].std() > 5


def test_a_hand_before_an_object_is_left_out_of_its_picture(visit: Visit) -> None:
    alone, mask = seen(visit, "bowl")
    visit.modules.evaluate(HOLD_BEFORE, ["bowl", *HEAD])
    image, still = seen(visit, "bowl")
    assert (still == mask).all()
    assert np.abs(image.astype(float) - alone).max() < 4


def test_frames_alone_are_looked_at_by_the_encoder(visit: Visit) -> None:
    truths = visit.truths()
    visit.modules.evaluate("({main}) => main.tell('frames')")
    decided = {key: visit.touch(key, patience_ms=LOOK_MS) or {} for key in FRAMES_ONLY}
    named = {key: decision.get("material", "none") for key, decision in decided.items()}
    print(json.dumps({"frames only": named, "right": sum(named[k] == truths[k] for k in named)}))
    assert {d["source"] for d in decided.values() if d} <= {"encoder", "unknown"}
    seen = [item for decision in decided.values() for item in decision.get("evidence", ())]
    assert {item["rung"] for item in seen} == {"encoder"}


def test_the_service_sends_a_controller_the_vibration_of_what_it_touches(visit: Visit) -> None:
    visit.modules.evaluate(
        """({main}) => {
          window.plans = [];
          main.haptics.addEventListener('vibration', ({detail}) => plans.push(detail));
        }"""
    )
    visit.touch("kettle", feels_plate=True)
    at_rest = "() => plans.some((one) => one.amplitude) && !plans.at(-1).amplitude"
    visit.page.wait_for_function(at_rest, timeout=60_000 * PACE)
    plans = visit.page.evaluate("plans")
    assert {plan["hand"] for plan in plans} == {"right"}
    assert max(max(plan.get("amplitude", [0])) for plan in plans) > 0.02
    assert "amplitude" not in plans[-1]


def test_a_controller_is_drawn_where_it_is_held(visit: Visit) -> None:
    visit.touch("linen")
    drawn = visit.modules.evaluate(
        """({main}) => {
          const {x, y, z} = main.headset.controllers.right.position;
          const bodies = main.hands.root.children.filter(({type}) => type === 'Group');
          return Math.min(...bodies.map(({position}) => position.distanceTo({x, y, z})));
        }"""
    )
    assert drawn < 0.06


def test_nothing_went_wrong_in_the_page(visit: Visit) -> None:
    assert visit.complaints == []
