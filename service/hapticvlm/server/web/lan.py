"""Opens the service to the local network by one option: `serve --lan`.

It makes a token once and keeps it, so that a phone which knows it goes on working, and writes the
links that a phone opens. The token is short enough to type on a phone, and long enough that nobody
guesses it over a network.
"""

from __future__ import annotations

import io
import os
import secrets
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import segno

from hapticvlm import documents
from hapticvlm.cache_folder import cache_folder
from hapticvlm.errors import UsageError
from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.settings import ServeOptions

LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # without those that look alike
GROUPS, GROUP = 3, 4  # 12 of 31 letters: 59 bits
MAX_BYTES = 256
NAME = "phone"  # any user name will do


def new_token() -> str:
    """Make a token, such as `k7mq-x2pd-9hwa`."""
    return "-".join("".join(secrets.choice(LETTERS) for _ in range(GROUP)) for _ in range(GROUPS))


def token_file() -> Path:
    """Return the file that keeps the token of `--lan`; only its owner may read it."""
    return cache_folder() / "lan-token"


def opened(options: ServeOptions) -> ServeOptions:
    """Return options that serve pages and scenes to the local network. Raises UsageError.

    What the user states stays: another address to listen on, or a token of their own.
    """
    return replace(
        options,
        host="0.0.0.0" if is_loopback(options.host) else options.host,
        token=kept_token() if options.token is None else options.token,
        pages_from="lan",
    )


def kept_token() -> str:
    """Read the token of the last time, or make one and keep it. Raises UsageError."""
    path = token_file()
    with suppress(OSError, ValueError):
        token = documents.read_bytes(path, MAX_BYTES).decode("ascii").strip()
        if len(token) >= GROUPS * GROUP:
            return token
    token = new_token()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        number = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(number, "w", encoding="ascii") as file:
            file.write(token + "\n")
    except OSError as error:
        problem = f"--lan: its token cannot be kept in {path} ({error.strerror})"
        raise UsageError(f"{problem}; set HAPTICVLM_TOKEN, or XDG_CACHE_HOME to a folder") from None
    return token


def lines(base: str, token: str | None) -> Iterator[str]:
    """Yield what a user needs to know to open `base`, such as `http://192.168.1.7:8790/`.

    `token` is None where others may read what is printed.
    """
    yield f"  on a phone   {phone_link(base, token) if token else f'{base}try'}"
    token = token or "in the file below, not written to a log"
    yield f"               a browser that asks: any name; password: {token}"
    yield f"  dashboard    {base}"
    yield f"  scenes       {base.replace('http', 'ws', 1)}   token: {token}"
    yield "  open to      anyone in your network who has the token; they can touch, stop and watch"
    yield f"  token        kept in {token_file()}; delete it to get another one"


def phone_link(base: str, token: str) -> str:
    """Return the link of the page to touch, with the token, for a terminal and not for a log.

    A browser that takes name and password from a link asks for nothing; others ask once.
    """
    scheme, rest = base.split("://", 1)
    return f"{scheme}://{NAME}:{quote(token, safe='')}@{rest}try"


def terminal_code(link: str) -> str:
    """Draw a link as a QR code (ISO/IEC 18004) of block characters."""
    drawn = io.StringIO()
    segno.make(link, error="l").terminal(drawn, compact=True, border=2)
    return drawn.getvalue()
