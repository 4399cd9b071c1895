"""Who may ask for pages and open a WebSocket: hosts, origins, and browsers of other sites."""

import base64
from types import SimpleNamespace
from typing import Any

import pytest
from asked import asked

from hapticvlm.messages import SceneObject
from hapticvlm.server.access import Address
from hapticvlm.server.web import http
from hapticvlm.server.web.local_pages import LoopbackPages
from hapticvlm.session.overrides import MaterialOverrides
from hapticvlm_studio.trials import page_server

TOKEN = "twelve-chars-at-least"
ORIGIN = frozenset({"https://studio.example"})


@pytest.mark.parametrize(
    ("host", "header", "admitted"),
    [
        ("127.0.0.1", "127.0.0.1:8790", True),
        ("127.0.0.1", "localhost", True),
        ("127.0.0.1", "evil.example", False),
        ("127.0.0.1", "192.168.1.5", False),
        ("0.0.0.0", "evil.example", False),  # a name that its owner pointed here
        ("0.0.0.0", "", False),
        ("0.0.0.0", "localhost:8790", True),
        ("0.0.0.0", "192.168.1.5:8790", True),
        ("0.0.0.0", "[fe80::1]:8790", True),
        ("0.0.0.0", "studio.example", True),  # named by --allow-origin
        ("0.0.0.0", "studio.example.evil.example", False),
    ],
)
def test_only_a_host_header_that_means_this_service_is_let_in(host, header, admitted):
    policy = Address(host, token=TOKEN, allowed_origins=ORIGIN).policy()
    refusal = policy.refusal(asked(host=header))
    assert (refusal is None) == admitted
    assert admitted or header[:5] in str(refusal)


def test_a_tunnel_is_let_in_by_its_name_and_its_own_pages_only() -> None:
    policy = Address(token=TOKEN, tunnels=frozenset({"abc.tunnel.example"})).policy()
    own = ("Origin", "https://abc.tunnel.example")
    assert policy.refusal(asked(host="abc.tunnel.example")) is None
    assert policy.refusal(asked("/", own, host="ABC.tunnel.example:443")) is None
    assert policy.refusal(asked("/", own, host="localhost")) is not None
    other = ("Origin", "https://evil.tunnel.example")
    assert policy.refusal(asked("/", other, host="abc.tunnel.example")) is not None
    assert policy.refusal(asked(host="evil.tunnel.example")) is not None
    near = ("Origin", "https://192.168.1.5:8790")
    policy = Address("0.0.0.0", token=TOKEN).policy()
    assert policy.refusal(asked("/", near, host="192.168.1.5:8790")) is not None, "no tunnel"
    with pytest.raises(ValueError, match=r"--allow-host abc\.tunnel\.example .* add a token"):
        Address(tunnels=frozenset({"abc.tunnel.example"}))


@pytest.mark.parametrize(("port", "admitted"), [(8790, True), (8791, False)])
def test_a_study_is_open_to_its_own_pages_and_not_to_another_of_this_machine(port, admitted):
    policy = http.AccessPolicy("127.0.0.1", frozenset(), is_open_to_own_pages_only=True)
    request = asked("/", ("Origin", f"http://127.0.0.1:{port}"), host="127.0.0.1:8790")
    assert (policy.refusal(request) is None) == admitted


@pytest.mark.parametrize(
    ("site", "mode", "dest", "refused"),
    [
        (None, None, None, False),  # no browser, or an old one
        ("none", "navigate", "document", False),  # typed into the address bar
        ("same-origin", "cors", "empty", False),
        ("cross-site", "navigate", "document", False),  # a link
        ("cross-site", "navigate", "iframe", True),
        ("cross-site", "no-cors", "image", True),
        ("same-site", "cors", "empty", True),  # another port of this machine
    ],
)
def test_a_page_of_another_site_may_link_here_and_fetch_nothing(site, mode, dest, refused):
    named = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode, "Sec-Fetch-Dest": dest}
    headers = [(name, value) for name, value in named.items() if value is not None]
    assert asked("/", *headers).is_cross_site == refused


@pytest.mark.parametrize("page", [page_server.PAGE, page_server.EXPERIMENTER])
@pytest.mark.parametrize(("is_study", "code"), [(False, 404), (True, 200)])
def test_the_pages_of_a_study_are_served_only_where_a_study_runs(is_study, code, page):
    folders = page_server.PAGES if is_study else (http.PAGES,)
    assert get(page, folders).status_code == code


def get(page, folders):
    policy = http.AccessPolicy("127.0.0.1", frozenset(), pages=folders)
    browser: Any = SimpleNamespace(remote_address=("127.0.0.1", 1), local_address=("127.0.0.1", 2))
    answer = http.answer(browser, asked(page), policy, None)
    assert answer is not None
    return answer


@pytest.mark.parametrize(
    "path",
    [
        "/../outside.js",
        "/%2e%2e/outside.js",
        "/..%2foutside.js",
        "/..%5coutside.js",
        "/inner/page.js",
        "/inner/../page.js",
        "/.//{root}/outside.js",
        "/page.js/",
        "/notes.txt",
    ],
)
def test_a_file_outside_the_pages_is_never_served(path, tmp_path):
    folder = tmp_path / "pages"
    (folder / "inner").mkdir(parents=True)
    for name in ("outside.js", "pages/page.js", "pages/inner/page.js", "pages/notes.txt"):
        (tmp_path / name).write_text("1;")
    assert get("/page.js", (folder,)).status_code == 200
    assert get(path.format(root=tmp_path), (folder,)).status_code == 404


@pytest.mark.parametrize(("peer", "code"), [("127.0.0.1", 200), ("192.168.1.9", 403)])
def test_material_overrides_never_leave_this_machine(peer, code):
    policy = Address("0.0.0.0", token=TOKEN, pages_from="lan").policy()
    cup = SceneObject(object_id="cup", material="glass")
    stated = MaterialOverrides({"cup": cup}).with_stated([SceneObject("box", material="wood")])
    pages = LoopbackPages(policy, lambda: stated)
    password = base64.b64encode(f":{TOKEN}".encode()).decode()
    header = ("Authorization", f"Basic {password}")
    browser: Any = SimpleNamespace(remote_address=(peer, 1), local_address=("192.168.1.5", 8790))
    answer = pages.answer(browser, asked("/stated.json", header, host="192.168.1.5:8790"))
    assert answer is not None
    assert answer.status_code == code
    assert (b"glass" in answer.body and b"wood" in answer.body) == (code == 200)
    assert pages.answer(browser, asked("/stated.json/other", header)) is None
