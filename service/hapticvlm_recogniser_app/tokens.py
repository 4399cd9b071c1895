"""The tokens of a shared recogniser: one for all clients, or one each, withdrawn alone.

A file of tokens is read again when it has changed, so nothing is restarted to withdraw one.
"""

from __future__ import annotations

import hmac
import logging
import re
import time
from collections.abc import Mapping
from pathlib import Path

from hapticvlm import documents
from hapticvlm.errors import UsageError
from hapticvlm_recogniser_app.settings import TOKEN, TOKENS

MIN_TOKEN = 12  # characters, off loopback and in a file; the same limit as the service has
ONLY = "all"  # the client where all have one token, or none
LOOK_S = 1.0  # between two looks at the file
_LINE = re.compile(rf"(?P<name>[\w.-]{{1,64}})[ \t]+(?P<token>[!-~]{{{MIN_TOKEN},}})")

logger = logging.getLogger(__name__)


class Tokens:
    """The clients that may use the recogniser, from the environment. Raises UsageError."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._one = environment.get(TOKEN) or None
        path = environment.get(TOKENS)
        self._file = Path(path) if path else None
        self._clients: dict[str, str] = {}
        self._stamp: tuple[int, int] | None = None
        self._looks_at = 0.0
        if self._one is not None and self._file is not None:
            raise UsageError(f"set {TOKEN} or {TOKENS}, not both")
        if self._file is not None:
            try:
                self._stamp, self._clients = _read(self._file)
            except (OSError, ValueError) as error:
                raise UsageError(f"{TOKENS}: {error}") from None

    @property
    def is_open(self) -> bool:
        """Whether every caller is admitted."""
        return self._one is None and self._file is None

    @property
    def are_many(self) -> bool:
        """Whether clients are told apart."""
        return self._file is not None

    @property
    def are_long(self) -> bool:
        """Whether they suffice off loopback."""
        return self._file is not None or len(self._one or "") >= MIN_TOKEN

    def client(self, authorization: str | None) -> str | None:
        """Return the name of the client with this Authorization header, None if it has no token."""
        if self.is_open:
            return ONLY
        scheme, _, secret = (authorization or "").partition(" ")
        if scheme.lower() != "bearer":
            return None
        known = {ONLY: self._one} if self._one is not None else self._current()
        # All are compared, each in constant time: the time says nothing of how near a guess is.
        given = secret.encode()
        found = [name for name, one in known.items() if hmac.compare_digest(given, one.encode())]
        return found[0] if found else None

    def _current(self) -> dict[str, str]:
        now = time.monotonic()
        if self._file is not None and now >= self._looks_at:
            self._looks_at = now + LOOK_S
            try:
                if _stamp(self._file) != self._stamp:
                    self._stamp, self._clients = _read(self._file)
                    logger.info("tokens read again: %d clients", len(self._clients))
            except (OSError, ValueError) as error:
                logger.error("the tokens stay as they were: %s", error)
        return self._clients


def _stamp(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_mtime_ns, found.st_size


def _read(path: Path) -> tuple[tuple[int, int], dict[str, str]]:
    """Read a file of tokens, a line `NAME TOKEN` each; `#` begins a comment.

    Raises OSError, ValueError.
    """
    stamp = _stamp(path)
    clients: dict[str, str] = {}
    for number, text in enumerate(documents.read_text(path).splitlines(), 1):
        line = text.strip()
        if not line or line.startswith("#"):
            continue
        match = _LINE.fullmatch(line)
        where = f"{path.name}, line {number}"
        if match is None:
            raise ValueError(f"{where}: use NAME TOKEN, a token of at least {MIN_TOKEN} characters")
        if match["name"] in clients or match["token"] in clients.values():
            raise ValueError(f"{where}: each name and each token may stand once")
        clients[match["name"]] = match["token"]
    return stamp, clients
