"""A model hub of one repository, with the part of its HTTP interface that a download uses."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

COMMIT = "0123456789abcdef0123456789abcdef01234567"


@contextmanager
def small_hub(name: str, folder: Path) -> Iterator[tuple[str, list[str]]]:
    """Serve a folder as a repository; yield the hub's address and the files that it has sent."""
    sent: list[str] = []
    files = {each.name: each.read_bytes() for each in folder.iterdir()}
    tree = [
        {"type": "file", "path": file, "size": len(content), "oid": "0"}
        for file, content in files.items()
    ]
    about = json.dumps({"id": name, "sha": COMMIT}).encode()
    bodies = {
        f"/api/models/{name}": about,
        f"/api/models/{name}/revision/main": about,
        f"/api/models/{name}/tree/{COMMIT}": json.dumps(tree).encode(),
    }
    bodies |= {f"/{name}/resolve/{COMMIT}/{file}": content for file, content in files.items()}

    class Handler(BaseHTTPRequestHandler):
        def do_HEAD(self) -> None:
            self.answer()

        def do_GET(self) -> None:
            if body := self.answer():
                self.wfile.write(body)
            if "/resolve/" in self.path:
                sent.append(Path(self.path).name)

        def answer(self) -> bytes | None:
            body = bodies.get(self.path.partition("?")[0])
            self.send_response(404 if body is None else 200)
            self.send_header("Content-Length", str(len(body or b"")))
            self.send_header("X-Repo-Commit", COMMIT)
            self.send_header("ETag", f'"{hashlib.sha256(body or b"").hexdigest()}"')
            self.end_headers()
            return body

        def log_message(self, *_: object) -> None:
            return

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}", sent
        server.shutdown()
