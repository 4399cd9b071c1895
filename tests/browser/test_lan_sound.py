"""Sound on plain http by a network address, where browsers have no audio worklets."""

from collections.abc import Iterator

import pytest
from dashboard_scene import PATIENCE_MS
from lan_address import TOKEN, own_address
from playwright.sync_api import Browser, Page, expect

from hapticvlm.client.local_service import running

pytestmark = pytest.mark.browser

# The loudest sample that left the page.
RECORD = """async () => {
  const { sound } = await import("./hear.js");
  const context = sound.output.context;
  const node = context.createScriptProcessor(512, 1, 1);
  window.loudest = 0;
  node.onaudioprocess = (event) => {
    const samples = event.inputBuffer.getChannelData(0);
    for (const sample of samples) loudest = Math.max(loudest, Math.abs(sample));
  };
  sound.output.connect(node);
  node.connect(context.destination);
  window.recorder = node;
}"""
HEARD = "() => loudest > 0.02"
SILENT = """async () => {
  window.loudest = 0;
  await new Promise((resolve) => setTimeout(resolve, 200));
  return loudest < 2e-3;
}"""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The service's page by this machine's network address, which needs the token."""
    with running(["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]) as service:
        yield service.page.replace("0.0.0.0", own_address())


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    context = browser.new_context(http_credentials={"username": "anyone", "password": TOKEN})
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(address)
    expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    assert not page.evaluate("isSecureContext")
    assert not page.evaluate("Boolean(AudioContext.prototype.audioWorklet)")
    yield page
    context.close()


def test_a_touch_is_heard_by_address_and_a_stop_silences_it(page: Page) -> None:
    page.locator("#hear").click()
    expect(page.locator("#hear")).to_have_text("Sound on")
    page.evaluate(RECORD)
    page.locator("#trial-material").select_option("wood")
    page.locator('[data-interaction="slide"]').hover()
    page.mouse.down()
    page.wait_for_function(HEARD)
    expect(page.locator("#hear-lag")).to_contain_text("ms behind")
    page.keyboard.press("Escape")
    page.wait_for_function(SILENT)
    page.mouse.up()
