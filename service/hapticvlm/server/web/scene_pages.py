"""Answers requests for a browser scene's files, which are read in a thread.

A web build of an engine has tens of megabytes. Read on the event loop it would hold up every touch
for as long as the disk takes, and a second browser may open the scene at any time.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from urllib.parse import urlsplit

from websockets.http11 import Request, Response

from hapticvlm.server.web import http, scene_files


async def answer(
    connection: http.Ends, request: Request, policy: http.AccessPolicy
) -> Response | None:
    """Answer a request for a file of the scene; None: it is for something else."""
    path = urlsplit(request.path).path
    folder = policy.scene_folder
    if folder is None or http.is_upgrade(request) or not path.startswith(scene_files.PREFIX):
        return None
    refused = http.refuse(connection, request, policy)
    return refused or await asyncio.to_thread(_file, folder, path)


def _file(folder: Path, path: str) -> Response:
    file = scene_files.find(folder, path)
    if file is None:
        return http.response(404, "no such file\n")
    body = file.read_bytes()
    is_page = file.suffix == ".html"
    csp = http.CSP + scene_files.policy(body.decode(errors="replace") if is_page else "")
    found = http.response(200, body, scene_files.kind(file) or "", csp)
    for name, value in scene_files.ISOLATION:
        found.headers[name] = value
    if (encoding := scene_files.encoding(file)) is not None:
        found.headers["Content-Encoding"] = encoding
    return found
