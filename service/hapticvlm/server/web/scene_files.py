"""The files of a browser scene, served beside the service so that both have one origin.

Only what lies in the folder, is not hidden and has a known type leaves it: scripts, pages, models,
pictures and sounds, and what engines built for the web are made of. Godot and Unity bring a program
(`.wasm`), its data (`.pck`, `.data`) and a page with a script of its own; Unity compresses them too
(`.gz`, `.br`), which the browser undoes when a header says so. Knows no request: scene_pages.py
answers those.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from urllib.parse import quote, unquote

PREFIX = "/scene/"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
SCENE_TYPES = {
    **TYPES,
    ".wasm": "application/wasm",  # browsers compile no other type while it loads
    ".pck": "application/octet-stream",
    ".data": "application/octet-stream",
    ".unityweb": "application/octet-stream",
    ".json": "application/json",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".webp": "image/webp",
    ".ico": "image/x-icon",
    ".glb": "model/gltf-binary",
    ".hdr": "image/vnd.radiance",
    ".mp3": "audio/mpeg",
    ".ogg": "audio/ogg",
    ".wav": "audio/wav",
}
ENCODINGS = {".gz": "gzip", ".br": "br"}
# Permissions that an engine needs to run. `wasm-unsafe-eval` compiles WebAssembly and nothing else;
# audio and threads of engines are scripts made on the fly (blob:); their pages style themselves. A
# glTF file holds its buffers and pictures itself, which loaders fetch as data: and blob:.
_ENGINE_POLICY = (
    "; connect-src 'self' data: blob:"
    "; img-src 'self' data: blob:; media-src 'self' data: blob:; worker-src 'self' blob:"
    "; style-src 'self' 'unsafe-inline'; script-src 'self' 'wasm-unsafe-eval' blob:"
)
# A page that no other site can open or be read by may share memory between threads.
ISOLATION = (
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Embedder-Policy", "require-corp"),
)
_INLINE_SCRIPT = re.compile(r"<script(?![^>]*\ssrc)[^>]*>(.*?)</script>", re.DOTALL)


def find(folder: Path, path: str) -> Path | None:
    """Return the file a request path below PREFIX means, or None: not there, or not to be had."""
    name = unquote(path.removeprefix(PREFIX))
    parts = name.split("/")
    if any(part.startswith(".") or "\\" in part or "\0" in part for part in parts):
        return None
    if parts[-1] == "":
        name += "index.html"
    try:
        # Links are followed before the comparison, so a link inside the folder that leads out of it
        # is not served, and `..` in any spelling ends outside. Hidden names are refused before:
        # `.git` and `.env` lie in many folders of a scene.
        root = folder.resolve()
        file = (root / name.lstrip("/")).resolve()
        inside = file.is_relative_to(root) and kind(file) is not None and file.is_file()
    except (OSError, RuntimeError):  # a name no file system takes; a circle of links
        return None
    return file if inside else None


def pages(folder: Path) -> list[str]:
    """Return the paths that open a page: of the folder, or else of the folders in it."""
    if find(folder, PREFIX) is not None:
        return [PREFIX]
    inner = sorted(page.parent.name for page in folder.glob("*/index.html"))
    paths = [f"{PREFIX}{quote(name)}/" for name in inner]
    return [path for path in paths if find(folder, path) is not None]


def kind(file: Path) -> str | None:
    """Return the type of a file's content, under its compression if it has one; None: unknown."""
    suffixes = file.suffixes
    if suffixes and suffixes[-1] in ENCODINGS:
        suffixes.pop()
    return SCENE_TYPES.get(suffixes[-1]) if suffixes else None


def encoding(file: Path) -> str | None:
    """Return how a file is compressed, in the words of HTTP, or None."""
    return ENCODINGS.get(file.suffix)


def policy(page: str) -> str:
    """Return what a page of the folder may run: its own files and the scripts it is written with.

    The page is the user's: each inline script is let run by its hash, so that none which somebody
    manages to write into it later does.
    """
    # The policy allows what the page had when it was read from the disk. A script that reaches the
    # page later, through a name of an object or a message, has another hash and does not run.
    return _ENGINE_POLICY + inline_scripts(page)


def inline_scripts(page: str) -> str:
    """Return the sources of a policy that let the inline scripts of a page run, by their hashes."""
    hashes = (hashlib.sha256(text.encode()).digest() for text in _INLINE_SCRIPT.findall(page))
    return "".join(f" 'sha256-{base64.b64encode(digest).decode()}'" for digest in hashes)
