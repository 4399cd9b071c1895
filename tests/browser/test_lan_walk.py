"""From a started service to a photograph that is heard and felt, by the machine's own address.

A laptop and a phone open `/try`, a photograph is dropped and stroked. A laptop's speaker is a
high-pass of 350 Hz, fourth order. Whether a phone vibrates cannot be seen here, so its calls to
`navigator.vibrate` are counted.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dashboard_scene import PATIENCE_MS
from lan_address import TOKEN, own_address
from phone import COUNT_VIBRATIONS
from playwright.sync_api import Browser, expect
from try_page import DROP, at, next_picture

from hapticvlm.client.local_service import running

pytestmark = [pytest.mark.browser, pytest.mark.nightly]
PHOTOGRAPH = Path(__file__).parent / "wooden_box.jpg"
PROFILES: dict[str, dict[str, Any]] = {
    "laptop": {"viewport": {"width": 1280, "height": 800}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
}
# The loudest sample that a small speaker would play of what leaves the page.
LISTEN = """async () => {
  const { sound } = await import("./hear.js");
  const context = sound.output.context;
  const node = context.createScriptProcessor(512, 1, 1);
  window.loudest = 0;
  node.onaudioprocess = ({ inputBuffer }) => {
    const samples = inputBuffer.getChannelData(0);
    for (const sample of samples) loudest = Math.max(loudest, Math.abs(sample));
  };
  // Two sections with the quality factors, in dB, of a Butterworth high-pass of fourth order.
  const section = (Q) => new BiquadFilterNode(context, { type: "highpass", frequency: 350, Q });
  const [first, second] = [-5.3, 2.3].map(section);
  sound.output.connect(first).connect(second).connect(node).connect(context.destination);
  window.recorder = node;
}"""
HEARD = 0.02  # of full scale


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The page by this machine's network address, which needs the token."""
    with running(["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]) as service:
        yield f"{service.page.replace('0.0.0.0', own_address())}try"


@pytest.mark.parametrize("device", PROFILES)
def test_a_dropped_photograph_is_heard_on_a_small_speaker_and_vibrates_a_phone(
    browser: Browser, address: str, device: str
) -> None:
    context = browser.new_context(
        http_credentials={"username": "anyone", "password": TOKEN},
        reduced_motion="reduce",
        **PROFILES[device],
    )
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.add_init_script(COUNT_VIBRATIONS)
    page.goto(address)
    expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    assert not page.evaluate("isSecureContext")
    with next_picture(page):
        data = base64.b64encode(PHOTOGRAPH.read_bytes()).decode()
        page.evaluate(DROP, ["mine.jpg", data])
    page.locator("#hear").click()
    expect(page.locator("#hear")).to_have_text("Sound on")
    page.evaluate(LISTEN)
    at(page, 0.4, 0.5)
    page.mouse.down()
    for turn in range(1000):
        at(page, 0.4 + 0.01 * (turn % 20), 0.5)
        if page.evaluate("loudest") > HEARD and (
            device == "laptop" or page.evaluate("vibrations.some(Boolean)")
        ):
            break
    page.mouse.up()
    assert page.evaluate("loudest") > HEARD
    assert device == "laptop" or page.evaluate("vibrations.some(Boolean)")
    context.close()
