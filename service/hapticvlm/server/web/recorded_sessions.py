"""The recorded sessions: listed, and each as a page to look through.

A session is looked up by its name in the listing of the folder; no name from a browser becomes a
path. A page is made by a command in a process of its own, one at a time and at low priority, so
that no touch waits for it. It is kept beside its session log.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import heapq
import http as codes
import json
import os
import stat
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from websockets.http11 import Response

from hapticvlm.errors import HapticVLMError
from hapticvlm.recordings.recorder import FRAMES, SESSION_LOG
from hapticvlm.server.web import http

PAGE = "session.html"
PART = ".session.part.html"
MOST = 200  # sessions listed, the newest
LISTED_S = 1.0  # a listing is kept
MAX_LOG_BYTES = 64 * 1024**2
MAX_PAGE_BYTES = 32 * 1024**2  # a browser waits a handshake's 5 s for it
BASE64 = 4 / 3
MAKE_S = 120.0
WAIT_S = 3.0  # within a handshake; then the browser comes again
RECENT_S = 10.0  # a session that still grows is not made anew this soon
NICE = 5  # at 10 a busy machine gave a page of 2 s of work more than a minute
_CSP = (
    "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; img-src data:; "
    "media-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; "
    "script-src data:"
)
_INLINE = (b'<script type="importmap">', b'<script type="module">')
_WAITING = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>HapticVLM session</title>
<p>The page of this session is being made.</p></html>
"""


class NoPage(HapticVLMError):
    """Why there is no page of a session."""


@dataclass(frozen=True, slots=True)
class Session:
    """One recorded session; times in s since 1970."""

    folder: Path
    written_at: float
    log_bytes: int

    @property
    def page(self) -> Path:
        """The page, once it is made."""
        return self.folder / PAGE

    def is_page_fresh(self) -> bool:
        """Whether the page is there and as new as the log, or was made just now."""
        try:
            # `lstat` and a regular file: the folder may have come from a stranger with a link in
            # place of the page, and following it would show, or write over, any file of the user.
            found = self.page.lstat()
        except OSError:
            return False
        is_new = found.st_mtime >= self.written_at or time.time() - found.st_mtime < RECENT_S
        return is_new and stat.S_ISREG(found.st_mode)

    def read_page(self) -> bytes:
        """Read the page. Raises NoPage."""
        if self.page.stat().st_size > MAX_PAGE_BYTES:
            raise NoPage(f"the page is too large to be sent: open {self.page} in a browser")
        return self.page.read_bytes()

    def check_size(self) -> None:
        """Raise NoPage for a session whose page would be too large."""
        # Known before a process is started: every picture goes into the page as text, a third
        # larger, and a browser waits no longer than a handshake for all of it.
        pictures = sum(size for _, size in _files(self.folder / FRAMES))
        if self.log_bytes > MAX_LOG_BYTES or pictures * BASE64 > MAX_PAGE_BYTES:
            raise NoPage(f"too long to be shown here: `hapticvlm replay --view` {self.folder}")


class RecordedSessions:
    """Answers for the sessions of one folder; `command` makes a page, as `replay` does."""

    def __init__(self, folder: Path, command: Sequence[str]) -> None:
        self._folder = folder.resolve()
        self._command = command
        self._listed: asyncio.Task[dict[str, Session]] | None = None
        self._listed_at = float("-inf")
        self._changed_at = 0
        self._making: asyncio.Task[str | None] | None = None
        self._made: Path | None = None

    async def answer(self, name: str) -> Response:
        """Show the session of this name, or list all for the empty name."""
        sessions = await self._listing()
        if not name:
            text = await asyncio.to_thread(_as_json, sessions)
            return http.response(200, text, "application/json")
        if name not in sessions:
            return http.response(404, "no such session\n")
        return await self._show(sessions[name])

    async def close(self) -> None:
        """End the process that makes a page, if one does."""
        if self._making is not None:
            self._making.cancel()
            await asyncio.wait({self._making})

    async def _listing(self) -> dict[str, Session]:
        """List the folder, once for all who ask within a second: thousands take long."""
        now = time.monotonic()
        listed = self._listed
        with suppress(OSError):
            changed_at = self._folder.stat().st_mtime_ns
            if changed_at != self._changed_at:  # a session is new
                self._changed_at = changed_at
                self._listed_at = float("-inf")
        if listed is None or (listed.done() and now - self._listed_at > LISTED_S):
            self._listed_at = now
            listed = self._listed = asyncio.create_task(asyncio.to_thread(listing, self._folder))
        return await asyncio.shield(listed)

    async def _show(self, session: Session) -> Response:
        try:
            if not await self._prepare(session):
                answer = http.response(202, _WAITING, "text/html; charset=utf-8")
                answer.headers["Refresh"] = "1"
                return answer
            page = await asyncio.to_thread(session.read_page)
        except (NoPage, OSError) as error:
            return http.response(codes.HTTPStatus.UNPROCESSABLE_ENTITY, f"{error}\n")
        csp = f"{_CSP} {' '.join(_script_sources(page))}"
        return http.response(200, page, "text/html; charset=utf-8", csp)

    async def _prepare(self, session: Session) -> bool:
        """Make the page where it is missing or old; return whether it is there. Raises NoPage."""
        if await asyncio.to_thread(session.is_page_fresh):
            return True
        await asyncio.to_thread(session.check_size)
        if self._making is None:
            self._made = session.folder
            self._making = asyncio.create_task(self._make(session))
        # One page at a time, whoever asks: two browsers that reload would otherwise start a process
        # each time. Who asks for another session meanwhile is told to come again, as is who waits
        # longer than a handshake may take.
        making = self._making
        is_this = self._made == session.folder
        await asyncio.wait({making}, timeout=WAIT_S)
        if not making.done():
            return False
        if self._making is making:
            self._making = None
        if is_this and (reason := making.result()):
            raise NoPage(reason)
        return is_this

    async def _make(self, session: Session) -> str | None:
        """Write the page, whole or not at all; return why there is none, or None."""
        part = session.folder / PART
        process: asyncio.subprocess.Process | None = None
        try:
            # A page of an hour is seconds of work on megabytes, in Python that would hold the
            # interpreter's lock and so every touch. In a process of its own at low priority it
            # costs the touches nothing, and a session that was tampered with brings down that
            # process alone. It writes beside the page; the rename at the end makes it whole for
            # whoever reads at that moment.
            process = await asyncio.create_subprocess_exec(
                *self._command,
                "--view",
                "--out",
                str(part),
                str(session.folder),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
            )
            _lower_priority(process.pid)
            async with asyncio.timeout(MAKE_S):
                _, errors = await process.communicate()
            if process.returncode:
                lines = errors.decode("utf-8", "replace").strip().splitlines()
                return lines[-1] if lines else "no page was made"
            part.replace(session.page)
        except TimeoutError:
            return f"the page was not made within {MAKE_S:.0f} s"
        except OSError as error:
            return f"no page was made: {error}"
        finally:
            if process is not None and process.returncode is None:
                process.kill()
                await process.wait()
            part.unlink(missing_ok=True)
        return None


def listing(folder: Path) -> dict[str, Session]:
    """Return the newest sessions of a folder by name, the newest first. Links are none of them."""
    try:
        entries = list(_sessions(folder))
    except OSError:
        return {}
    newest = heapq.nlargest(MOST, entries, key=lambda entry: entry[1].written_at)
    return dict(newest)


def _sessions(folder: Path) -> Iterator[tuple[str, Session]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError, UnicodeEncodeError):
                entry.name.encode()
                if not entry.is_dir(follow_symlinks=False):
                    continue
                log = (Path(entry.path) / SESSION_LOG).lstat()
                if stat.S_ISREG(log.st_mode):
                    yield entry.name, Session(Path(entry.path), log.st_mtime, log.st_size)


def _files(folder: Path) -> Iterator[tuple[str, int]]:
    """Yield the name and size in bytes of each file of a folder, if there is one."""
    with suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            yield entry.name, entry.stat().st_size


def _as_json(sessions: dict[str, Session]) -> str:
    rows = [
        {
            "name": name,
            "written_at": session.written_at,
            "log_bytes": session.log_bytes,
            "has_frames": (session.folder / FRAMES).is_dir(),
        }
        for name, session in sessions.items()
    ]
    return json.dumps({"sessions": rows}) + "\n"


def _script_sources(page: bytes) -> Iterator[str]:
    """Name the inline scripts of the page for its policy: the first and the last."""
    for opening, find in zip(_INLINE, (page.find, page.rfind), strict=True):
        start = find(opening)
        if start >= 0:
            start += len(opening)
            digest = hashlib.sha256(page[start : page.find(b"</script>", start)]).digest()
            yield f"'sha256-{base64.b64encode(digest).decode()}'"


def _lower_priority(pid: int) -> None:
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, pid, NICE)
