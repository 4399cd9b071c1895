"""Answers requests for a browser scene's files, which are read in a thread.

A web build of an engine has tens of megabytes. Read on the event loop it would hold up every touch
for as long as the disk takes, and kept in memory it would be there once for every reader. So files
leave in pieces.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from websockets.http11 import Response

from hapticvlm import documents
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.edge.socket import FileResponse
from hapticvlm.server.web import http, scene_files


async def answer(
    connection: http.Ends, request: HttpRequest, policy: http.AccessPolicy
) -> Response | None:
    """Answer a request for a file of the scene; None: it is for something else."""
    folder = policy.scene_folder
    is_for_scene = request.path.startswith(scene_files.PREFIX)
    if folder is None or request.is_upgrade or not is_for_scene:
        return None
    refused = http.refuse(connection, request, policy)
    return refused or await asyncio.to_thread(_file, folder, request.path)


def _file(folder: Path, path: str) -> Response:
    file = scene_files.find(folder, path)
    if file is None:
        return http.response(404, "no such file\n")
    try:
        # The policy names the inline scripts of a page by their hashes, so a page is read first.
        page = file.read_bytes().decode(errors="replace") if file.suffix == ".html" else ""
        size = file.stat().st_size
    except OSError as error:
        return http.response(500, f"{path[:80]}: {documents.reason(error)}\n")
    csp = http.CSP + scene_files.policy(page)
    head = http.response(200, b"", scene_files.kind(file) or "", csp)
    del head.headers["Content-Length"]
    head.headers["Content-Length"] = str(size)
    for name, value in scene_files.ISOLATION:
        head.headers[name] = value
    if (encoding := scene_files.encoding(file)) is not None:
        head.headers["Content-Encoding"] = encoding
    return FileResponse(head.status_code, head.reason_phrase, head.headers, path=file, size=size)
