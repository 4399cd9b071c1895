"""From a started service to a photograph that is heard and felt, by the machine's own address.

A laptop and a phone open `/try`, a photograph is dropped and stroked, and a stop silences it. On
plain http by a network address browsers have no audio worklets. Whether a phone vibrates cannot be
seen here, so its calls to `navigator.vibrate` are counted.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dashboard_scene import PATIENCE_MS
from lan_address import TOKEN, own_address
from phone import COUNT_VIBRATIONS, LISTEN
from playwright.sync_api import Browser, expect
from tiers import nightly_except
from try_page import DROP, at, next_picture

from hapticvlm.client.local_service import running

pytestmark = pytest.mark.browser
PHOTOGRAPH = Path(__file__).parent / "wooden_box.jpg"
PROFILES: dict[str, dict[str, Any]] = {
    "laptop": {"viewport": {"width": 1280, "height": 800}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
}
HEARD = 1e-4  # mean square, re full scale
SILENT = """async () => {
  window.loudest = 0;
  await new Promise((resolve) => setTimeout(resolve, 200));
  return loudest < 4e-6;
}"""


@pytest.fixture
def address() -> Iterator[str]:
    """The page by this machine's network address, which needs the token; no hand is stopped yet."""
    with running(["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]) as service:
        yield f"{service.page.replace('0.0.0.0', own_address())}try"


@pytest.mark.parametrize("device", nightly_except(2, PROFILES))
def test_a_dropped_photograph_is_heard_on_a_small_speaker_and_vibrates_a_phone_until_a_stop(
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
    assert not page.evaluate("Boolean(AudioContext.prototype.audioWorklet)")
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
    assert page.evaluate("loudest") > HEARD
    assert device == "laptop" or page.evaluate("vibrations.some(Boolean)")
    expect(page.locator("#hear-lag")).to_contain_text("ms behind")
    page.keyboard.press("Escape")
    page.wait_for_function(SILENT)
    page.mouse.up()
    context.close()
