"""A chat endpoint on loopback that answers as a test scripts it, byte for byte."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from pace import PACE

from hapticvlm.vlm.contract import DEFAULT_MODEL

PATIENCE_S = 30.0 * PACE  # a socket of the endpoint that hears nothing this long gives up


@dataclass(frozen=True)
class Request:
    verb: str
    path: str
    headers: Mapping[str, str]
    body: Any


Reply = Callable[[socket.socket, Request], None]


@dataclass
class Served:
    """What an endpoint was asked, and where it is."""

    url: str
    requests: list[Request] = field(default_factory=list)

    @property
    def questions(self) -> list[Any]:
        return [one.body for one in self.requests if one.verb == "POST"]


@contextmanager
def endpoint(
    reply: Reply | Sequence[Reply], models: Sequence[str] | None = (DEFAULT_MODEL,)
) -> Iterator[Served]:
    """Answer each question with `reply`, or with one of several in turn, the last for ever.

    It lists `models` when asked for them; None: it does not know that path.
    """
    replies = [reply] if callable(reply) else list(reply)
    listing = sends("Not Found", "404 Not Found")
    if models is not None:
        listing = sends(json.dumps({"data": [{"id": name} for name in models]}))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        served = Served(f"http://127.0.0.1:{listener.getsockname()[1]}")
        thread = threading.Thread(
            target=_serve, args=(listener, served, listing, replies), daemon=True
        )
        thread.start()
        try:
            yield served
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            thread.join(PATIENCE_S)


def says(text: object, **choice: Any) -> Reply:
    """Answer with a text as a chat model does."""
    message = {"role": "assistant", "content": text}
    whole = {"index": 0, "message": message, "finish_reason": "stop", **choice}
    return sends(json.dumps({"object": "chat.completion", "choices": [whole]}))


def sends(body: str | bytes, status: str = "200 OK", **headers: object) -> Reply:
    """Answer with any body, status and headers; `Content_Length` may lie."""
    data = body.encode() if isinstance(body, str) else body
    stated = {"Content_Type": "application/json", "Content_Length": len(data)} | headers
    lines = [f"{name.replace('_', '-')}: {value}" for name, value in stated.items()]
    head = "\r\n".join([f"HTTP/1.1 {status}", *lines, "", ""])
    return raw(head.encode() + data)


def raw(data: bytes) -> Reply:
    """Answer with these bytes, whatever they are."""
    return lambda sock, _: sock.sendall(data)


def _serve(
    listener: socket.socket, served: Served, listing: Reply, replies: Sequence[Reply]
) -> None:
    with suppress(OSError):
        while True:
            sock, _ = listener.accept()
            sock.settimeout(PATIENCE_S)
            line = (sock, served, listing, replies)
            threading.Thread(target=_answer, args=line, daemon=True).start()


def _answer(sock: socket.socket, served: Served, listing: Reply, replies: Sequence[Reply]) -> None:
    with sock, suppress(OSError), sock.makefile("rb") as file:
        try:
            request = _read(file)
        except ValueError:  # no HTTP
            return
        turn = min(len(served.questions), len(replies) - 1)
        served.requests.append(request)
        (listing if request.verb == "GET" else replies[turn])(sock, request)


def _read(file: Any) -> Request:
    verb, path, _ = file.readline().decode().split()
    headers = {}
    while line := file.readline().decode().strip():
        name, _, value = line.partition(":")
        headers[name.lower()] = value.strip()
    length = int(headers.get("content-length", 0))
    return Request(verb, path, headers, json.loads(file.read(length)) if length else None)
