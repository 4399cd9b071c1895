"""The files of a browser scene, served beside the service so that both have one origin.

Only what lies in the folder, is not hidden and has a known type leaves it. Files are read whole on
the event loop: scripts of a megabyte, once, before a scene can touch anything.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from urllib.parse import unquote

PREFIX = "/scene/"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
_IMPORT_MAP = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)


def find(folder: Path, path: str) -> Path | None:
    """Return the file a request path below PREFIX means, or None: not there, or not to be had."""
    name = unquote(path.removeprefix(PREFIX))
    parts = name.split("/")
    if any(part.startswith(".") or "\\" in part or "\0" in part for part in parts):
        return None
    if parts[-1] == "":
        name += "index.html"
    try:
        root = folder.resolve()
        file = (root / name.lstrip("/")).resolve()
        inside = file.is_relative_to(root) and file.suffix in TYPES and file.is_file()
    except OSError:  # a name no file system takes
        return None
    return file if inside else None


def script_sources(page: str) -> str:
    """Name a page's import maps for its policy: they are the only inline scripts let run."""
    hashes = (hashlib.sha256(text.encode()).digest() for text in _IMPORT_MAP.findall(page))
    return "".join(f" 'sha256-{base64.b64encode(digest).decode()}'" for digest in hashes)
