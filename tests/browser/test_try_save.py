"""What is saved of a touch on `/try`: files for other tools, the same as `feel --save` writes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from saved_zip import unpacked
from scipy.signal import resample_poly
from try_page import at, sample, visit

from hapticvlm.client.local_service import Service
from hapticvlm.touches import ahap, haptic
from hapticvlm.touches.felt import feel

pytestmark = pytest.mark.browser
PAGE_HZ = 3000  # of the waveform that the page gets
WRITE = """async (moment) => {
  const { ahap, haptic } = await import("./felt.formats.js");
  return [haptic(moment), ahap(moment)];
}"""


def envelope(document: dict[str, Any], name: str) -> np.ndarray:
    points = document["signals"]["continuous"]["envelopes"][name]
    return np.array([point[name] for point in points])


def curve(document: dict[str, Any], name: str) -> np.ndarray:
    curves = [one["ParameterCurve"] for one in document["Pattern"] if "ParameterCurve" in one]
    points = {
        round(one["Time"] + point["Time"], 3): point["ParameterValue"]
        for one in curves
        if one["ParameterID"] == name
        for point in one["ParameterCurveControlPoints"]
    }
    return np.array([points[at_s] for at_s in sorted(points)])


@pytest.mark.parametrize(("material", "interaction"), [("wood", "slide"), ("glass", "tap")])
def test_haptic_and_ahap_are_those_of_export(
    browser: Browser, service: Service, material: str, interaction: str
) -> None:
    touch = feel(material, interaction, seconds=1.0)
    samples = resample_poly(touch.vibration, 1, touch.rate_hz // PAGE_HZ).tolist()
    moment = {"material": material, "interaction": interaction, "rateHz": PAGE_HZ}
    page = browser.new_page()
    page.goto(f"{service.page}ring.js")
    here = page.evaluate(WRITE, moment | {"samples": samples})
    page.close()
    for kind, own, exported in (
        ("haptic", here[0], haptic.document(touch.clip())),
        ("ahap", here[1], ahap.document(touch.clip())),
    ):
        if kind == "haptic":
            assert own["version"] == exported["version"]
            pairs = [(envelope(own, n), envelope(exported, n)) for n in ("amplitude", "frequency")]
        else:
            names = ("HapticIntensityControl", "HapticSharpnessControl")
            pairs = [(curve(own, n), curve(exported, n)) for n in names]
            assert [list(one) for one in own["Pattern"]] == [list(o) for o in exported["Pattern"]]
        for level, expected in pairs[:1]:
            assert level.size == expected.size
            assert np.abs(level - expected).max() < 0.1 * expected.max()
        loud = pairs[0][1] > 0.1 * pairs[0][1].max()
        assert np.median(np.abs(pairs[1][0] - pairs[1][1])[loud]) < 0.05


@pytest.mark.nightly
def test_a_touch_is_saved_as_picture_sound_haptics_and_a_page(
    browser: Browser, service: Service
) -> None:
    with visit(browser, service) as page:
        expect(page.locator("#save")).to_be_hidden()
        sample(page, "kettle")
        stroke(page)
        with page.expect_download() as download:
            page.locator("#save").click()
        expect(page.locator("#saved")).to_contain_text("Saved felt-metal-slide.zip")
        unpacked(download.value.path())


def stroke(page: Page) -> None:
    """Stroke until the page has something to save."""
    at(page, 0.4, 0.5)
    page.mouse.down()
    for turn in range(400):
        if page.locator("#save").is_visible() and turn > 20:
            break
        at(page, 0.4 + 0.01 * (turn % 20), 0.5)
    page.mouse.up()
