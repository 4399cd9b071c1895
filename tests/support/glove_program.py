"""Stands in for the program of a TouchDIVER."""

from __future__ import annotations

import contextlib
import socket
import threading


class GloveProgram:
    """The program: what each point of each hand does now, by its texts."""

    def __init__(self, port: int = 0, *, answers: bool = True) -> None:
        self.listener = socket.create_server(("127.0.0.1", port))
        self.port = self.listener.getsockname()[1]
        self.starts = self.stops = self.ended = 0
        self.now: dict[tuple[str, str, str], list[str]] = {}
        self.connection: socket.socket | None = None
        self._answers = answers
        threading.Thread(target=self._run, daemon=True).start()

    def has_started(self) -> bool:
        return self.starts > 0

    def vibrates(self) -> bool:
        return "texture" in self.kinds()

    def rests(self) -> bool:
        return not self.now

    def kinds(self) -> set[str]:
        return {kind for kind, _, _ in list(self.now)}

    def fields(self, kind: str, hand: str = "RIGHT") -> list[str]:
        return self.now.get((kind, hand, "PALM"), [])

    def close(self) -> None:
        for part in (self.listener, self.connection):
            if part is not None:
                with contextlib.suppress(OSError):
                    part.shutdown(socket.SHUT_RDWR)
                part.close()

    def _run(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                self.connection, _ = self.listener.accept()
                if self._answers:
                    self._read(self.connection)
                    self.ended += 1

    def _read(self, connection: socket.socket) -> None:
        rest = ""
        while more := connection.recv(4096):
            *texts, rest = (rest + more.decode()).split("~")
            for text in texts:
                self._take(text)

    def _take(self, text: str) -> None:
        kind, *fields = text.split(":")
        if kind == "StartFromClient":
            self.starts += 1
            self.now = {}
        elif kind == "StopFromClient":
            self.stops += 1
        elif kind.startswith("stop"):
            self.now.pop((kind[4:].lower(), fields[-2], fields[-1]), None)
        elif kind in ("force", "texture", "temperature"):
            self.now[kind, fields[-2], fields[-1]] = fields[:-2]
