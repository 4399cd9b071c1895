"""The files of a browser scene: what is served, and what never leaves the machine."""

import asyncio
import base64
import hashlib
import socket
import tracemalloc
import urllib.request
from collections import Counter
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from asked import asked
from each_case import each
from pace import PACE

from hapticvlm.client.local_service import ServiceError, running
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import PHASES, Phase
from hapticvlm.server.edge.listener import Listener
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.web import http, scene_files, scene_pages

MAP = '\n  {"imports": {"three": "./three.js"}}\n'
PAGE = f'<!doctype html>\n<script type="importmap">{MAP}</script>\n'


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "scene"
    (root / "parts").mkdir(parents=True)
    (root / ".git").mkdir()
    (root / "index.html").write_text(PAGE)
    for name in ("parts/main.js", "a b.js", "secret.pem", ".git/hook.js", ".hidden.js"):
        (root / name).write_text("1;")
    (tmp_path / "outside.js").write_text("secret;")
    (root / "link.js").symlink_to(tmp_path / "outside.js")
    (root / "loop.js").symlink_to(root / "loop.js")
    (root / "inner.js").symlink_to(root / "parts" / "main.js")
    return root


def test_the_addresses_of_its_pages_are_known(folder, tmp_path):
    (folder / "parts" / "index.html").write_text(PAGE)
    room = tmp_path / "room 2"
    room.mkdir()
    (room / "index.html").write_text(PAGE)

    assert scene_files.pages(folder) == ["/scene/"]
    assert scene_files.pages(tmp_path) == ["/scene/room%202/", "/scene/scene/"]
    assert scene_files.pages(folder / ".git") == []


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("/scene/", "index.html"),
        ("/scene/index.html", "index.html"),
        ("/scene/parts/main.js", "parts/main.js"),
        ("/scene/a%20b.js", "a b.js"),
        ("/scene/inner.js", "parts/main.js"),
    ],
)
def test_pages_and_scripts_of_the_folder_are_found(folder, path, found):
    assert scene_files.find(folder, path) == folder / found


@each(
    path=[
        "/scene/../outside.js",
        "/scene/%2e%2e/outside.js",
        "/scene/parts/..%2f..%2foutside.js",
        "/scene/parts/%2e%2e/%2e%2e/outside.js",
        "/scene/..%5coutside.js",
        "/scene/%2fetc/hosts.js",
        "/scene//etc/hosts.js",
        "/scene/link.js",
        "/scene/loop.js",
        "/scene/secret.pem",
        "/scene/.hidden.js",
        "/scene/.git/hook.js",
        "/scene/parts",
        "/scene/parts/",
        "/scene/main.js%00.html",
        "/scene/%ff%fe.js",
        "/scene/" + "x" * 5000 + ".js",
    ]
)
def test_nothing_else_is(folder, path):
    assert scene_files.find(folder, path) is None


def test_a_page_may_run_the_scripts_it_is_written_with_and_no_other_inline():
    digest = base64.b64encode(hashlib.sha256(MAP.encode()).digest()).decode()
    assert scene_files.policy(PAGE).endswith(f" 'sha256-{digest}'")
    assert "'unsafe-inline'" not in scene_files.policy(PAGE).partition("script-src")[2]
    assert "sha256" not in scene_files.policy('<script src="main.js"></script>')


@pytest.mark.parametrize(
    ("name", "kind", "encoding"),
    [
        ("index.wasm", "application/wasm", None),
        ("index.pck", "application/octet-stream", None),
        ("build.data.br", "application/octet-stream", "br"),
        ("build.wasm.gz", "application/wasm", "gzip"),
        ("build.unityweb", "application/octet-stream", None),
        ("style.css", "text/css; charset=utf-8", None),
        ("part.mjs", "text/javascript; charset=utf-8", None),
        ("icon.svg", "image/svg+xml", None),
        ("list.json", "application/json", None),
        ("photo.png", "image/png", None),
        ("photo.jpg", "image/jpeg", None),
        ("photo.webp", "image/webp", None),
        ("icon.ico", "image/x-icon", None),
        ("room.glb", "model/gltf-binary", None),
        ("sky.hdr", "image/vnd.radiance", None),
        ("hit.mp3", "audio/mpeg", None),
        ("hit.ogg", "audio/ogg", None),
        ("hit.wav", "audio/wav", None),
        ("notes.txt", None, None),
        ("archive.gz", None, "gzip"),
    ],
)
def test_what_engines_build_for_the_web_has_its_type_and_compression(name, kind, encoding):
    assert scene_files.kind(Path(name)) == kind
    assert scene_files.encoding(Path(name)) == encoding


async def test_a_compressed_file_says_so_and_without_a_folder_nothing_is_for_the_scene(tmp_path):
    (tmp_path / "build.wasm.gz").write_bytes(b"1")
    (tmp_path / "page.js").write_text("1;")
    ends: Any = SimpleNamespace(remote_address=("127.0.0.1", 1), local_address=("127.0.0.1", 2))
    said = []
    names = ("build.wasm.gz", "page.js", "none.js")
    for folder, name in (*((tmp_path, name) for name in names), (None, "page.js")):
        policy = http.AccessPolicy("127.0.0.1", frozenset(), scene_folder=folder)
        answer = await scene_pages.answer(ends, asked(f"/scene/{name}"), policy)
        told = answer and (answer.status_code, answer.headers.get("Content-Encoding", "plain"))
        said.append(told)
    assert said == [(200, "gzip"), (200, "plain"), (404, "plain"), None]


def test_the_service_serves_them_with_a_strict_policy_when_asked_to(folder):
    with running(["--scene", str(folder)]) as service:
        with urllib.request.urlopen(service.page + "scene/", timeout=30 * PACE) as page:
            assert page.read().decode() == PAGE
            assert "'sha256-" in page.headers["Content-Security-Policy"]
            assert page.headers["Cross-Origin-Opener-Policy"] == "same-origin"
            assert page.headers["Cross-Origin-Embedder-Policy"] == "require-corp"
        part = service.page + "scene/parts/main.js"
        with urllib.request.urlopen(part, timeout=30 * PACE) as script:
            assert script.headers["Content-Type"] == "text/javascript; charset=utf-8"
            assert "sha256" not in script.headers["Content-Security-Policy"]


BIG = 16 * 1024 * 1024  # as an engine's program


@pytest.fixture
def big(folder):
    """A scene with a large program, and how a browser of this machine asks for it."""
    with (folder / "engine.wasm").open("wb") as program:
        program.truncate(BIG)
    policy = http.AccessPolicy("127.0.0.1", frozenset(), scene_folder=folder)
    browser: Any = SimpleNamespace(remote_address=("127.0.0.1", 1), local_address=("127.0.0.1", 2))
    return lambda: scene_pages.answer(browser, asked("/scene/engine.wasm"), policy)


@asynccontextmanager
async def listening(answer):
    limiter: SocketLimiter[ClientSocket] = SocketLimiter(Counter())
    listener = Listener(limiter, lambda *_: answer(), lambda _: asyncio.sleep(0), BIG)
    async with listener.listen("127.0.0.1", 0) as port:
        yield port, limiter


REQUEST = b"GET /scene/engine.wasm HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


async def test_forty_readers_of_a_large_file_that_read_nothing_hold_little_memory(big):
    async with listening(big) as (port, limiter):
        tracemalloc.start()
        readers = [socket.create_connection(("127.0.0.1", port)) for _ in range(40)]
        for each in readers:
            each.sendall(REQUEST)
        async with asyncio.timeout(10.0 * PACE):
            while sum(not each.is_writable for each in limiter.sockets) < 40:  # noqa: ASYNC110 - nothing says when
                await asyncio.sleep(0.01)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        for each in readers:
            each.close()
    assert peak < 40 * 4 * 64 * 1024  # a few pieces of each, where whole files were 640 MiB


async def test_a_browser_on_a_slow_network_gets_the_whole_of_a_large_file(big, monkeypatch):
    monkeypatch.setitem(PHASES, Phase.ASKING, replace(PHASES[Phase.ASKING], seconds=3.0))
    got = 0
    async with listening(big) as (port, _):
        slow = socket.create_connection(("127.0.0.1", port))
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 64 * 1024)
        reader, writer = await asyncio.open_connection(sock=slow, limit=64 * 1024)
        writer.write(REQUEST)
        await reader.readuntil(b"\r\n\r\n")
        while piece := await reader.read(64 * 1024):
            got += len(piece)
            await asyncio.sleep(0.015)  # the whole takes longer than a piece may
        writer.close()
    assert got == BIG


def test_a_scene_folder_that_is_not_there_is_said_at_start(tmp_path):
    with (
        pytest.raises(ServiceError, match="no folder of this name"),
        running(["--scene", str(tmp_path / "nowhere")]),
    ):
        pass
