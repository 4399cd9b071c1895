"""The dashboard as another machine of the network sees it: over https, for the token, by wss.

Chromium is told to take the made-up authority's certificate (`ignore_https_errors`); that clients
check it is shown in test_wss.py.
"""

from collections.abc import Iterator
from contextlib import suppress

import pytest
from certificates import NAMES, Authority
from dashboard_scene import PATIENCE_MS, WATCH_POLICY
from lan_address import TOKEN, own_address
from playwright.sync_api import Error, expect

from hapticvlm.client.local_service import Service, running
from hapticvlm.server.web.lan import phone_link

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    authority = Authority(tmp_path_factory.mktemp("authority"))
    pair = authority.sign(names=f"{NAMES},IP:{own_address()}")
    lan = ["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]
    with running([*lan, *pair.flags]) as found:
        yield found


def test_the_dashboard_is_seen_from_the_network_over_https_and_follows_by_wss(browser, service):
    context = browser.new_context(
        ignore_https_errors=True, http_credentials={"username": "anyone", "password": TOKEN}
    )
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.add_init_script(WATCH_POLICY)
    page.goto(service.page.replace("0.0.0.0", own_address()))
    expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    expect(page.locator("#token-form")).to_be_hidden()
    assert page.evaluate("isSecureContext")  # what WebXR asks for
    assert page.evaluate("violations") == []
    assert TOKEN not in page.url
    context.close()


def test_the_link_for_a_phone_asks_for_nothing_and_leaves_no_token_in_the_address(browser, service):
    context = browser.new_context(ignore_https_errors=True)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(phone_link(service.page.replace("0.0.0.0", own_address()), TOKEN))
    expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
    expect(page.locator("#token-form")).to_be_hidden()
    assert TOKEN not in page.evaluate("document.URL")
    context.close()


def test_without_the_token_the_browser_shows_nothing(browser, service):
    context = browser.new_context(ignore_https_errors=True)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    seen: list[int] = []
    page.on("response", lambda answer: seen.append(answer.status))
    with suppress(Error):  # Chromium may call it a failed navigation
        page.goto(service.page.replace("0.0.0.0", own_address()))
    assert seen == [401]
    assert "HapticVLM" not in page.title()
    context.close()
