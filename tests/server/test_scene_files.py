"""The files of a browser scene: what is served, and what never leaves the machine."""

import base64
import hashlib
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from hapticvlm.client.local_service import ServiceError, running
from hapticvlm.server.web import scene_files

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
    (root / "inner.js").symlink_to(root / "parts" / "main.js")
    return root


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


@pytest.mark.parametrize(
    "path",
    [
        "/scene/../outside.js",
        "/scene/%2e%2e/outside.js",
        "/scene/parts/..%2f..%2foutside.js",
        "/scene/parts/%2e%2e/%2e%2e/outside.js",
        "/scene/..%5coutside.js",
        "/scene/%2fetc/hosts.js",
        "/scene//etc/hosts.js",
        "/scene/link.js",
        "/scene/secret.pem",
        "/scene/.hidden.js",
        "/scene/.git/hook.js",
        "/scene/parts",
        "/scene/parts/",
        "/scene/main.js%00.html",
        "/scene/%ff%fe.js",
        "/scene/" + "x" * 5000 + ".js",
    ],
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
        ("notes.txt", None, None),
        ("archive.gz", None, "gzip"),
    ],
)
def test_what_engines_build_for_the_web_has_its_type_and_compression(name, kind, encoding):
    assert scene_files.kind(Path(name)) == kind
    assert scene_files.encoding(Path(name)) == encoding


def test_the_service_serves_them_with_a_strict_policy_when_asked_to(folder):
    with running(["--scene", str(folder)]) as service:
        with urllib.request.urlopen(service.page + "scene/", timeout=30) as page:
            assert page.read().decode() == PAGE
            assert "'sha256-" in page.headers["Content-Security-Policy"]
            assert page.headers["Cross-Origin-Opener-Policy"] == "same-origin"
            assert page.headers["Cross-Origin-Embedder-Policy"] == "require-corp"
        with urllib.request.urlopen(service.page + "scene/parts/main.js", timeout=30) as script:
            assert script.headers["Content-Type"] == "text/javascript; charset=utf-8"
            assert "sha256" not in script.headers["Content-Security-Policy"]
        for path in ("scene/%2e%2e/outside.js", "scene/secret.pem"):
            with pytest.raises(urllib.error.HTTPError) as missing:
                urllib.request.urlopen(service.page + path, timeout=30)
            assert missing.value.code == 404
            missing.value.close()


def test_a_scene_folder_that_is_not_there_is_said_at_start(tmp_path):
    with (
        pytest.raises(ServiceError, match="no such folder"),
        running(["--scene", str(tmp_path / "nowhere")]),
    ):
        pass
