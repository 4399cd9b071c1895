"""Who may ask for pages and open a WebSocket: hosts, origins, and browsers of other sites."""

import base64
import json
from types import SimpleNamespace
from typing import Any

import pytest
from asked import asked
from lan_address import own_address
from prometheus_client.parser import text_string_to_metric_families

from hapticvlm.messages import SceneObject
from hapticvlm.server.access import Address
from hapticvlm.server.web import http
from hapticvlm.server.web.lan_pages import HERE_ONLY, LanPages, qr_code
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
    assert (refusal is None, policy.lan_pages) == (admitted, None)
    assert admitted or header[:5] in str(refusal)


def test_a_tunnel_is_let_in_by_its_name_and_its_own_pages_only() -> None:
    assert (Address().host, Address().port) == ("127.0.0.1", 8790)
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


@pytest.mark.parametrize(
    ("path", "name", "kind"),
    [
        ("/", "index.html", "text/html; charset=utf-8"),
        ("/try", "try.html", "text/html; charset=utf-8"),
        ("/try.cloth.jpg", "try.cloth.jpg", "image/jpeg"),
    ],
)
def test_a_page_is_served_by_its_name_or_a_shorter_one(path, name, kind):
    answer = get(path, (http.PAGES,))
    assert answer.headers["Content-Type"] == kind
    assert answer.body == (http.PAGES / name).read_bytes()


def get(page, folders):
    policy = http.AccessPolicy("127.0.0.1", frozenset(), pages=folders)
    browser: Any = SimpleNamespace(remote_address=("127.0.0.1", 1), local_address=("127.0.0.1", 2))
    answer = http.answer(browser, asked(page), policy, None)
    assert answer is not None
    return answer


LABEL = 'an "odd"\\\nname'
STATUS: dict[str, Any] = {
    "connections": 1,
    "leases": 2,
    "speaker": {"level": 0.3, "underruns": 4, "lost_commands": 5, "restarts": 6, "plays": True},
    "plate": {"plate_c": 7.5, "setpoint_c": 8.5, "dose_cem43": 9.5, "faults": []},
    "recogniser": {"restarts": 10, "busy_s": 11.5, "ready": True},
    "vlm": {"answered": 14, "failed": 15},
    "counts": {LABEL: 16},
}
STATUS["speaker"]["faults"] = ["silent"]
STATUS["recogniser"]["remote"] = {"answered": 12, "failed": 13}
BAD = {
    **STATUS,
    "speaker": {"plays": False},
    "recogniser": {"ready": False},
    "plate": {"faults": ["plate_silent"]},
}
FIGURES = """
connections 1.0
leases 2.0
speaker_level 0.3
plate_celsius 7.5
setpoint_celsius 8.5
dose_cem43_minutes 9.5
underruns_total 4.0
lost_commands_total 5.0
engine_restarts_total 6.0
recogniser_restarts_total 10.0
recogniser_busy_seconds_total 11.5
shared_recogniser_answered_total 12.0
shared_recogniser_failed_total 13.0
vlm_answered_total 14.0
vlm_failed_total 15.0
events_total{kind="an \\"odd\\"\\\\\\nname"} 16.0
fault{name="silent"} 1.0
"""


def reported(path, status, lan_pages=None):
    """What a program of this machine is answered: the status, the type and the text."""
    policy = http.AccessPolicy("127.0.0.1", frozenset(), lan_pages=lan_pages)
    ends: Any = SimpleNamespace(remote_address=("127.0.0.1", 1), local_address=("127.0.0.1", 8790))
    answer = http.answer(ends, asked(path), policy, lambda: status)
    assert answer is not None
    headers = dict(answer.headers.raw_items())
    kind = headers.pop("Content-Type")
    assert headers == {**HEADERS, "Content-Length": str(len(answer.body))}
    return answer.status_code, kind, answer.body.decode()


HEADERS = {
    "Connection": "close",
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
TEXT = "text/plain; charset=utf-8"
OBSTACLES = """the audio engine does not play
the recogniser is not loaded
fault plate_silent
"""


@pytest.mark.parametrize(
    ("path", "status", "told"),
    [
        ("/healthz", BAD, (200, TEXT, "ok\n")),
        ("/readyz", STATUS, (200, TEXT, "ok\n")),
        ("/readyz", BAD, (503, TEXT, OBSTACLES)),
        ("/token", STATUS, (404, TEXT, "no token was given\n")),
        ("/connect.svg", STATUS, (404, TEXT, f"{HERE_ONLY}\n")),
        ("/none.js", STATUS, (404, TEXT, "no such page\n")),
    ],
)
def test_a_report_says_this(path, status, told):
    assert reported(path, status) == told


def test_the_status_and_the_codes_say_where_others_open_the_pages():
    nowhere = {"page": None, "why": HERE_ONLY}
    told = json.dumps({**STATUS, "reach": nowhere}) + "\n"
    assert reported("/status", STATUS) == (200, "application/json", told)
    lan_pages = LanPages(TOKEN, frozenset(), "https")
    page = f"https://{own_address()}:8790/"
    *_, text = reported("/status", STATUS, lan_pages)
    assert json.loads(text)["reach"] == {"page": page, "why": None}
    for path, place in (("/connect.svg", ""), ("/connect-try.svg", "try")):
        drawn = reported(path, STATUS, lan_pages)
        assert drawn == (200, "image/svg+xml", qr_code(page + place))
        assert drawn[2].startswith("<svg ")


def test_each_figure_of_the_metrics_is_that_of_the_status():
    code, kind, text = reported("/metrics", STATUS)
    assert (code, kind.partition(";")[0]) == (200, "text/plain")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    assert lines == [f"hapticvlm_{line}" for line in FIGURES.strip().splitlines()]
    families = [*text_string_to_metric_families(text)]
    assert len(families) == len(lines)
    for each in families:
        assert each.type == ("counter" if f"{each.name}_total" in text else "gauge")
    gone = reported("/metrics", {**STATUS, "vlm": None, "plate": {"faults": []}})[2]
    assert "hapticvlm_vlm_failed_total 0.0\n" in gone
    assert "plate_celsius" not in gone


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
