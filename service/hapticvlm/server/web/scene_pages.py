"""Answers requests for a browser scene's files, which are read in a thread.

A web build of an engine has tens of megabytes. Read on the event loop it would hold up every touch
for as long as the disk takes, and kept in memory it would be there once for every reader. So files
leave in pieces. Only a page is read whole, for the hashes of its inline scripts.
"""

from __future__ import annotations

import asyncio
import http as statuses
from pathlib import Path

from websockets.http11 import Response

from hapticvlm import documents
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.edge.socket import FileResponse
from hapticvlm.server.web import http, scene_files

MAX_PAGE_BYTES = 8 * documents.MIB


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
        response = _page(file) if file.suffix == ".html" else _piecewise(file)
    except (OSError, ValueError) as error:
        return http.response(500, f"{path[:80]}: {documents.reason(error)}\n")
    for name, value in scene_files.ISOLATION:
        response.headers[name] = value
    if (encoding := scene_files.encoding(file)) is not None:
        response.headers["Content-Encoding"] = encoding
    return response


def _page(file: Path) -> Response:
    """Return a page with the policy that its own scripts need. Raises OSError, ValueError."""
    body = documents.read_bytes(file, MAX_PAGE_BYTES)
    csp = http.CSP + scene_files.policy(body.decode(errors="replace"))
    return http.response(200, body, scene_files.kind(file) or "", csp)


def _piecewise(file: Path) -> Response:
    size = file.stat().st_size
    csp = http.CSP + scene_files.policy("")
    headers = http.response(200, b"", scene_files.kind(file) or "", csp).headers
    del headers["Content-Length"]
    headers["Content-Length"] = str(size)
    phrase = statuses.HTTPStatus.OK.phrase
    return FileResponse(200, phrase, headers, path=file, size=size)
