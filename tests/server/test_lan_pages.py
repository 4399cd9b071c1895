"""Pages off this machine: none by default, with the token for the local network's browsers."""

import base64
import time
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from asked import asked
from each_case import each, each_row
from lan_address import own_address
from pace import PACE
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import InvalidStatus

from hapticvlm.client import Refused, connect
from hapticvlm.client.local_service import Service, running
from hapticvlm.server.access import Address
from hapticvlm.server.web import http
from hapticvlm.server.web.lan_pages import LanPages, is_near, is_token, own_names, qr_code, reach

TOKEN = "pässword of a dozen"


@pytest.fixture(scope="module")
def visited() -> Iterator[Service]:
    with running(["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]) as found:
        yield found


def at_own_address(service: Service) -> str:
    return service.page.replace("0.0.0.0", own_address())


def basic(password: str) -> str:
    return "Basic " + base64.b64encode(f"anyone:{password}".encode()).decode()


def got(url: str, **headers: str) -> tuple[int, dict[str, str], str]:
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=30 * PACE) as page:
            return page.status, dict(page.headers), page.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, dict(error.headers), error.read().decode()


def test_no_page_is_served_to_the_network_without_the_token(visited):
    wrong = {"Authorization": basic("wrong")}, {"Authorization": "Bearer " + TOKEN}
    paths = ("", "dashboard.js", "status", "healthz", "nothing")
    for path, headers in (*((path, {}) for path in paths), *(("", headers) for headers in wrong)):
        code, told, text = got(at_own_address(visited) + path, **headers_of(headers))
        assert code == 401
        assert told["WWW-Authenticate"].startswith("Basic ")
        assert "HapticVLM" not in text


def headers_of(given: dict[str, str]) -> dict[str, str]:
    return {name: value.encode().decode("latin-1") for name, value in given.items()}


def test_pages_are_served_to_the_network_for_the_token(visited):
    code, told, text = got(at_own_address(visited), Authorization=basic(TOKEN))
    assert (code, told["Cache-Control"]) == (200, "no-store")
    assert "HapticVLM" in text
    code, _, text = got(at_own_address(visited) + "status", Authorization=basic(TOKEN))
    assert (code, TOKEN in text) == (200, False)
    code, _, text = got(visited.page.replace("0.0.0.0", "127.0.0.1"))  # this machine needs none
    assert (code, "HapticVLM" in text) == (200, True)


def test_a_page_learns_the_token_only_where_its_browser_has_given_it(visited):
    for base in (at_own_address(visited), visited.page.replace("0.0.0.0", "127.0.0.1")):
        assert got(base + "token", Authorization=basic(TOKEN))[::2] == (200, TOKEN)
        for headers in ({}, {"Authorization": basic("wrong")}):
            code, _, text = got(base + "token", **headers)
            assert code in (401, 404)
            assert TOKEN not in text
    assert got(visited.page.replace("0.0.0.0", "127.0.0.1") + "token")[0] == 404  # no dialog


async def test_only_pages_of_this_service_may_connect_and_still_need_the_token(visited):
    url = visited.url.replace("0.0.0.0", own_address())
    own = at_own_address(visited).rstrip("/")
    port = own.rpartition(":")[2]
    for origin in (own.replace(port, "1"), own.replace("http", "https"), "http://evil.example"):
        with pytest.raises(InvalidStatus, match="403"):
            async with open_socket(url, proxy=None, additional_headers={"Origin": origin}):
                pass
    rebound = {"Origin": f"http://evil.example:{port}", "Host": f"evil.example:{port}"}
    with pytest.raises(InvalidStatus, match=r"40[03]"):  # this client sends two Host headers
        async with open_socket(url, proxy=None, additional_headers=rebound):
            pass
    headers = {"Origin": own, "Authorization": basic(TOKEN)}
    async with open_socket(url, proxy=None, additional_headers=headers) as raw:
        await raw.send('{"type": "stop", "id": 1, "scope": "all"}')
        assert "hello first" in str(await raw.recv()) or "say hello" in str(await raw.recv())
    with pytest.raises(Refused, match="token"):
        async with connect(url, token="wrong"):
            pass


@each_row(
    ("peer", "near"),
    [
        ("192.168.1.7", True),
        ("10.0.0.1", True),
        ("172.16.3.4", True),
        ("169.254.1.1", True),
        ("fe80::1%eth0", True),
        ("fd00::2", True),
        ("127.0.0.1", True),
        ("::ffff:192.168.1.7", True),
        ("::ffff:8.8.8.8", False),
        ("8.8.8.8", False),
        ("172.32.0.1", False),
        ("2600::1", False),
        ("not an address", False),
    ],
)
def test_the_local_network_is_private_and_link_local_addresses(peer, near):
    assert is_near(peer) == near
    lan_pages = LanPages(TOKEN, own_names(), "http")
    assert (lan_pages.refusal(peer, "192.168.1.2:8790") is None) == near


@each(
    authorization=[
        "",
        "Basic",
        "Basic ",
        "Basic !!!!",
        "Basic YQ==",
        "Basic a",
        "Basic \xff",
        "basic " + TOKEN,
        "Bearer " + basic(TOKEN).removeprefix("Basic "),
    ]
)
def test_what_is_no_authorization_is_no_token(authorization):
    assert not is_token(authorization, TOKEN)


@pytest.mark.parametrize(
    ("host", "ours"),
    [
        ("192.168.1.2:8790", True),
        ("[fd00::2]:8790", True),
        ("studio.example:8790", True),
        ("STUDIO.example", True),
        ("localhost:8790", True),
        ("evil.example", False),
        ("192.168.1.2.evil.example", False),
        ("", False),
        ("[broken", False),
    ],
)
def test_own_names_are_addresses_and_what_the_certificate_says(host, ours):
    lan_pages = LanPages(TOKEN, own_names(["studio.example"]), "https")
    assert (lan_pages.refusal("192.168.1.7", host) is None) == ours
    assert lan_pages.is_own_origin(f"https://{host}", host) == ours
    assert not lan_pages.is_own_origin(f"http://{host}", host)


def test_a_network_is_let_in_only_where_it_can_come_and_by_a_token_nobody_guesses():
    with pytest.raises(ValueError, match=r"--host 0\.0\.0\.0"):
        Address(token=TOKEN, pages_from="lan")
    with pytest.raises(ValueError, match="12 characters"):
        Address(host="0.0.0.0", token="short", pages_from="lan")


def test_a_code_of_29_modules_has_two_of_white_around_it_and_without_the_flag_there_is_none():
    assert 'width="264" height="264"' in qr_code("http://192.168.1.5:8790/#token")
    assert reach(None, 8790)["page"] is None


def test_none_or_two_authorization_headers_are_no_token():
    lan_pages = LanPages(TOKEN, own_names(), "http")
    given = ("Authorization", basic(TOKEN).encode().decode("latin-1"))
    assert http.turn_away("192.168.1.7", asked("/", host="192.168.1.2"), lan_pages) is not None
    without = http.turn_away("192.168.1.7", asked("/", given, host="192.168.1.2"), None)
    assert without is not None
    assert (without.status_code, b"--lan" in without.body) == (403, True)
    once, twice = (asked("/", *[given] * times, host="192.168.1.2") for times in (1, 2))
    assert http.turn_away("192.168.1.7", once, lan_pages) is None
    answer = http.turn_away("192.168.1.7", twice, lan_pages)
    assert answer is not None
    assert answer.status_code == 401


def test_the_ready_lines_say_how_others_come_and_that_they_can_read_along(visited):
    until = time.monotonic() + 60.0
    while "priority" not in (said := "".join(visited.printed)) and time.monotonic() < until:
        time.sleep(0.05)
    assert "the token as password" in said
    assert "unencrypted" in said
    assert TOKEN not in said
