"""The recorded sessions of a service: shown on its own machine, looked up by name only."""

import asyncio
import base64
import json
import os
import shutil
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import quote

import pytest
from conftest import peer
from pace import PACE
from recorded_session import record
from test_lan_pages import OWN, networked

from hapticvlm.client.local_service import running
from hapticvlm.server.web import recorded_sessions
from hapticvlm.server.web.recorded_sessions import RecordedSessions, listing

HOSTILE = ["<img src=x onerror=alert(1)>", "a b#t=1?c%2e%2e", "..;x", "\\..\\y", "\N{SNOWMAN}\n'\""]
TOKEN = "a token of a dozen"
PATIENCE_S = 60.0 * PACE


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of recorded sessions, some with names that somebody chose to harm."""
    root = tmp_path_factory.mktemp("kept")
    session = record(root / "sessions")
    for name in HOSTILE:
        shutil.copytree(session, session.with_name(name))
    outside = record(root / "away").rename(root / "elsewhere")
    session.with_name("link").symlink_to(outside)
    session.with_name("no session").mkdir()
    (root / "sessions" / "file").write_text("no folder")
    return root / "sessions"


@pytest.fixture(scope="module")
def service(folder):
    with running(["--record", str(folder)]) as found:
        yield found


def get(service, path, headers=(), address=None):
    page = service.page if address is None else service.page.replace("127.0.0.1", address)
    request = urllib.request.Request(page + path, headers=dict(headers))
    until = time.monotonic() + PATIENCE_S
    while True:
        with urllib.request.urlopen(request, timeout=30 * PACE) as answer:
            if answer.status != 202 or time.monotonic() > until:
                return answer.read().decode(), answer
        time.sleep(0.3)


def refusal(service, path, headers=(), address=None):
    with pytest.raises(urllib.error.HTTPError) as refused:
        get(service, path, headers, address)
    with refused.value as error:
        return error.code, error.read().decode()


def test_sessions_are_listed_and_links_files_and_other_folders_are_not(service, folder):
    text, answer = get(service, "sessions")
    rows = json.loads(text)["sessions"]
    (recorded,) = folder.glob("2*")
    assert {row["name"] for row in rows} == {*HOSTILE, recorded.name}
    assert all(row["has_frames"] and row["log_bytes"] > 1000 for row in rows)
    assert answer.headers["Cache-Control"] == "no-store"


@pytest.mark.parametrize("name", [HOSTILE[0], HOSTILE[-1]])
def test_the_page_of_a_session_is_shown_whatever_its_name(service, name):
    text, answer = get(service, f"sessions/{quote(name, safe='')}")
    assert '"TeaMug_01"' in text
    assert "<img src=x" not in text
    policy = answer.headers["Content-Security-Policy"]
    assert policy.startswith("sandbox allow-scripts; default-src 'none'")
    assert policy.count("'sha256-") == 2
    assert "connect-src" not in policy


@pytest.mark.parametrize(
    "name",
    [
        "..",
        "../elsewhere",
        "%2e%2e%2felsewhere",
        "%2e%2e",
        ".",
        "link",
        "no session",
        "file",
        "<img src=x onerror=alert(1)>/",
        "<img src=x onerror=alert(1)>/tape.jsonl",
        "nothing%00",
        "%ff%fe",
        "/etc/passwd",
        "x" * 3000,
    ],
)
def test_a_name_that_is_not_listed_is_no_path(service, name):
    assert refusal(service, "sessions/" + quote(name, safe="/%"))[0] == 404


def test_a_session_that_names_a_picture_of_another_folder_is_not_shown(service, folder):
    stolen = folder / "stolen"
    shutil.copytree(next(folder.glob("2*")), stolen)
    (stolen / "session.html").unlink(missing_ok=True)
    (folder.parent / "secret.jpg").write_bytes(b"secret")
    log = stolen / "tape.jsonl"
    log.write_text(log.read_text().replace("frames/000001.jpg", "../../secret.jpg"))
    try:
        code, text = refusal(service, "sessions/stolen")
    finally:
        shutil.rmtree(stolen)
    assert (code, "outside this folder" in text) == (422, True)


def test_without_a_recording_folder_there_are_no_sessions():
    with running() as service:
        assert refusal(service, "sessions")[0] == 404


@networked
def test_sessions_want_the_token_and_leave_this_machine_never(tmp_path):
    options = ["--host", "0.0.0.0", "--token", TOKEN, "--pages-from", "lan"]
    password = base64.b64encode(f":{TOKEN}".encode()).decode()
    given = {"Authorization": f"Basic {password}"}
    with running([*options, "--record", str(tmp_path)]) as service:
        here = service.page.replace("0.0.0.0", "127.0.0.1")
        service.url = here.replace("http", "ws", 1)
        assert refusal(service, "sessions")[0] == 401
        assert json.loads(get(service, "sessions", given)[0]) == {"sessions": []}
        assert refusal(service, "sessions", given, OWN)[0] == 403


def noted(notes):
    until = time.monotonic() + PATIENCE_S
    while not notes.is_file() or not notes.read_text():
        assert time.monotonic() < until
        time.sleep(0.1)
    return notes.read_text().split()


async def test_one_page_is_made_at_a_time_and_nobody_waits_for_it(tmp_path, monkeypatch):
    monkeypatch.setattr("hapticvlm.server.web.recorded_sessions.WAIT_S", 0.2)
    first = record(tmp_path)
    shutil.copytree(first, first.with_name("second"))
    notes = tmp_path / "notes"
    wait = f"import os, time; open({str(notes)!r}, 'a').write(f'{{os.getpid()}} '); time.sleep(60)"
    sessions = RecordedSessions(tmp_path, (sys.executable, "-c", wait))
    answers = await asyncio.gather(sessions.answer(first.name), sessions.answer("second"))
    assert [answer.status_code for answer in answers] == [202, 202]
    (maker,) = await asyncio.to_thread(noted, notes)
    await sessions.close()
    with pytest.raises(ProcessLookupError):
        os.kill(int(maker), 0)


async def test_a_session_that_goes_on_is_shown_too(service, folder):
    before = set(listing(folder))
    async with peer(service) as scene:
        await scene.hello()
        await scene.ask(type="scene", objects=[{"object_id": "cup"}], replace=True)
        await scene.touch("contact", "cup")
        await scene.touch("release", "cup")
        await asyncio.sleep(0.5)
        (name,) = set(listing(folder)) - before
        text, _ = await asyncio.to_thread(get, service, f"sessions/{quote(name)}")
        assert '"object_id": "cup"' in text


async def test_a_listing_is_kept_for_a_second_unless_a_session_is_new(tmp_path, monkeypatch):
    read: list[Path] = []

    def read_folder(folder):
        read.append(folder)
        return {}

    monkeypatch.setattr(recorded_sessions, "listing", read_folder)
    sessions = RecordedSessions(tmp_path, ["true"])
    await asyncio.gather(*(sessions.answer("") for _ in range(20)))
    assert (await sessions.answer("unknown")).status_code == 404
    assert len(read) == 1
    (tmp_path / "new").mkdir()
    await sessions.answer("")
    assert len(read) == 2
    monkeypatch.setattr(recorded_sessions, "LISTED_S", -1.0)
    await sessions.answer("")
    assert len(read) == 3
