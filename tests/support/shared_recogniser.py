"""A shared recogniser on loopback without Ray: the real answers, and every way to misbehave."""

from __future__ import annotations

import http.server
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec

from hapticvlm.vision.encoders import living
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app import replies
from hapticvlm_recogniser_app.replies import Embedded, Refusal, load_galleries
from hapticvlm_recogniser_app.settings import TOKEN
from hapticvlm_recogniser_app.tokens import Tokens

HANG_S = 3.0
# Beliefs in place of those of the gallery, by fault.
KNOWING_NOTHING: dict[str | None, list[tuple[str, float]]] = {
    "no beliefs": [],
    "beliefs of zero": [("wood", 0.0), ("glass", 0.0)],
}


class Shared(http.server.ThreadingHTTPServer):
    """What it is asked is counted; `fault` is what it does instead of answering."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, paths: dict[str, str], port: int) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.encoder = load_encoder()
        self.galleries = load_galleries(paths, self.encoder)
        self.fault: str | None = None
        self.token: str | None = None
        self.asked: list[bytes] = []
        self.open: set[socket.socket] = set()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def identity(self, name: str) -> bytes:
        return msgspec.json.encode(replies.find(self.galleries, name).identity)

    def answer(self, body: bytes) -> bytes:
        job = replies.read_job(body, self.galleries, time.monotonic())
        rows = zip(*living.embed(self.encoder, job.crops), strict=True)
        embedded = [Embedded(row, 1, 0.0, 1.0, float(alive)) for row, alive in rows]
        data = replies.write_answer(job, embedded)
        if self.fault not in KNOWING_NOTHING:
            return data
        answer = msgspec.msgpack.decode(data, type=contract.Answer)
        beliefs = KNOWING_NOTHING[self.fault]
        results = [msgspec.structs.replace(result, beliefs=beliefs) for result in answer.results]
        return msgspec.msgpack.encode(msgspec.structs.replace(answer, results=results))


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Shared

    def setup(self) -> None:
        self.server.open.add(self.request)
        super().setup()

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""

    def do_GET(self) -> None:
        self._guarded(lambda _: self.server.identity(self.path.partition("gallery=")[2]))

    def do_POST(self) -> None:
        self._guarded(self.server.answer)

    def _guarded(self, answer: object) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        if self.command == "POST":
            self.server.asked.append(body)
        try:
            known = Tokens({TOKEN: self.server.token} if self.server.token else {})
            if known.client(self.headers.get("Authorization")) is None:
                raise Refusal(401, "send the token")
            assert callable(answer)
            data, status = answer(body), 200
        except Refusal as refusal:
            data, status = msgspec.json.encode({"error": str(refusal)}), refusal.status
        with suppress(OSError):  # who asked has given up
            self._send(data, status)

    def _send(self, data: bytes, status: int) -> None:
        fault = self.server.fault if self.command == "POST" else None
        if fault == "hangs":
            time.sleep(HANG_S)
        if fault == "closes":
            self.close_connection = True
            return
        if fault == "garbage":
            data = b"<html>" + bytes(range(256))
        if fault == "fails":
            status = 500
        if fault == "wrong hash":
            data = data.replace(self._hash(), b"0" * 16)
        self.send_response(status)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if fault == "dribbles":
            for byte in data:
                self.wfile.write(bytes([byte]))
                time.sleep(0.05)
        else:
            self.wfile.write(data)

    def _hash(self) -> bytes:
        return self.server.galleries[contract.SHIPPED].identity.hash.encode()


@contextmanager
def shared_recogniser(port: int = 0, **paths: Path) -> Iterator[Shared]:
    """Run one; `paths` are its galleries by name. At the end it is gone, connections too."""
    shared = Shared({name: str(path) for name, path in paths.items()}, port)
    thread = threading.Thread(target=shared.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield shared
    finally:
        shared.shutdown()
        shared.server_close()
        for sock in shared.open:
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
        thread.join(10.0)
