"""Serves the pages of a study on loopback: static files, and a WebSocket of JSON maps per page.

A page receives the texts of all languages once, then the whole view after every change. It sends
commands ({"do": ...}); a command that is not possible is answered with {"refused": reason}. The
participant's page is at `/`, the experimenter's at `/experimenter`; only the latter receives which
pattern is presented. Connections pass the service's own listener with its limits. Only pages of
this address are admitted, and a page that does not read what it is sent is closed.

All pages share one event loop and one lock: commands are carried out one after the other, so the
conductor never sees two at once, whichever page sends them.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec
from websockets.frames import CloseCode
from websockets.http11 import Response

from hapticvlm import documents
from hapticvlm.client import Client, connect
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import REFUSED, TokenBucket
from hapticvlm.server.edge.listener import Listener
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.web import http
from hapticvlm_studio.design import languages
from hapticvlm_studio.design.design import Design
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.conductor import Conductor
from hapticvlm_studio.trials.player import Player
from hapticvlm_studio.trials.record import Pace

HOST = "127.0.0.1"
PAGES = (Path(__file__).parents[1] / "pages", http.PAGES)  # the study's, and those of the service
PAGE = "/study.html"
EXPERIMENTER = "/experimenter.html"
EXPERIMENTER_SOCKET = "/experimenter"  # the WebSocket of the experimenter's page
OUTPUTS_EVERY_S = 0.5  # between two reports of the outputs to that page
MAX_COMMAND_BYTES = 32_768
MAX_UNREAD_BYTES = 1024 * 1024  # a page that reads nothing is closed; it reconnects by itself


@dataclass(frozen=True, slots=True)
class Setting:
    """Address and access rules of a study; `url` and `token` are those of its service."""

    folder: Path
    url: str
    port: int = 0
    pace: Pace = field(default_factory=Pace)
    settle_c: float = 0.8
    token: str | None = None


class StudyServer:
    """The open pages of one study, and their commands."""

    def __init__(self, conductor: Conductor, greeting: dict[str, Any]) -> None:
        self._conductor = conductor
        self._greeting = json.dumps(greeting)
        self._pages: set[ClientSocket] = set()
        self._experimenters: set[ClientSocket] = set()
        self._turn = asyncio.Lock()
        conductor.notify = self._notify

    def _notify(self) -> None:
        _send(self._pages, json.dumps(self._conductor.view()))
        self._notify_experimenters()

    def _notify_experimenters(self) -> None:
        _send(self._experimenters, json.dumps(self._conductor.overview()))

    async def report_outputs(self) -> None:
        """Send the outputs to the experimenter's pages until cancelled."""
        while True:
            await asyncio.sleep(OUTPUTS_EVERY_S)
            if self._experimenters:
                self._notify_experimenters()

    def play(self, waveform: dict[str, Any]) -> None:
        """Send the speaker's waveform to the participant's pages, which play it."""
        _send(self._pages, json.dumps({"waveform": waveform}))

    def show_plate(self, plate_c: float | None) -> None:
        """Send the plate's temperature to the participant's pages, which show it as colour."""
        _send(self._pages, json.dumps({"plate_c": plate_c}))

    async def serve_page(self, socket: ClientSocket) -> None:
        """Serve one page until it disconnects."""
        is_experimenter = socket.request is not None and socket.request.path == EXPERIMENTER_SOCKET
        pages = self._experimenters if is_experimenter else self._pages
        shown = self._conductor.overview() if is_experimenter else self._conductor.view()
        refusals = TokenBucket(REFUSED, time.monotonic())
        socket.mark_admitted()
        socket.write(self._greeting)
        socket.write(json.dumps(shown))
        pages.add(socket)
        try:
            while True:
                is_done = await self._receive(socket, await socket.recv())
                if not is_done and not refusals.spend(1, time.monotonic()):
                    socket.refuse(Count.CLOSED_REFUSED_MESSAGES)
                await asyncio.sleep(0)  # lets the other pages run
        finally:
            pages.discard(socket)

    async def _receive(self, socket: ClientSocket, data: bytes | str) -> bool:
        """Carry out a page's command or refuse it; return whether it was carried out."""
        try:
            command = documents.parse_json(data)
            if not isinstance(command, dict):
                raise StudyError("not a command")
            async with self._turn:
                await self._conductor.do(command)
        except (StudyError, ConnectionError, ValueError) as error:
            await socket.send(json.dumps({"refused": str(error)}))
            return False
        return True


def _send(pages: Iterable[ClientSocket], message: str) -> None:
    """Write a message to each page without waiting, and close pages that read too slowly."""
    for page in tuple(pages):
        if page.transport.get_write_buffer_size() > MAX_UNREAD_BYTES:
            page.close(CloseCode.TRY_AGAIN_LATER, "the page reads too slowly")
        page.write(message)


async def run(design: Design, setting: Setting, ready: Callable[[str], None]) -> None:
    """Run a study until it is cancelled; `ready` is called with the address of the page.

    Raises StudyError when the service disconnects or another scene owns its outputs, and Refused
    or OSError when the service or the port cannot be used.
    """
    greeting = {
        "texts": {code: languages.texts(code, setting.folder) for code in design.form.languages},
        "form": msgspec.to_builtins(design.form),
    }
    async with AsyncExitStack() as stack:
        client = await stack.enter_async_context(
            connect(setting.url, name="hapticvlm study", token=setting.token)
        )
        player = Player(client, setting.settle_c)
        await player.prepare(design.stimuli)
        _in_background(stack, player.listen())
        conductor = Conductor(design, setting.folder, player, setting.pace)
        server = StudyServer(conductor, greeting)
        if setting.pace.hear:
            observer = connect(
                setting.url, name="study, heard", role="observer", token=setting.token
            )
            _in_background(stack, _relay_outputs(await stack.enter_async_context(observer), server))
        _in_background(stack, server.report_outputs())
        port = await stack.enter_async_context(_listening(server, setting.port))
        stack.push_async_callback(conductor.leave)
        ready(f"http://{HOST}:{port}{PAGE}")
        await _until_gone(client)


async def _relay_outputs(observer: Client, server: StudyServer) -> None:
    """Relay what the speaker plays and how warm the plate is, as the dashboard receives both."""
    await observer.set(watch=["waveform"])
    while True:
        event = await observer.events.get()
        if event["type"] == "view" and event["kind"] == "waveform":
            server.play({name: event[name] for name in ("start", "samples", "rate_hz")})
        elif event["type"] == "telemetry":
            server.show_plate(event["plate_c"])


async def _until_gone(client: Client) -> None:
    await client.wait_closed()
    raise StudyError("the service closed the connection; nothing is lost: start again to continue")


def _in_background(stack: AsyncExitStack, work: Coroutine[Any, Any, None]) -> None:
    """Run `work` until the study ends."""
    stack.push_async_callback(_cancel, asyncio.create_task(work))


async def _cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


@asynccontextmanager
async def _listening(server: StudyServer, port: int) -> AsyncIterator[int]:
    policy = http.AccessPolicy(HOST, frozenset(), pages=PAGES, is_open_to_own_pages_only=True)

    async def answer(socket: ClientSocket, request: HttpRequest) -> Response | None:
        page = replace(request, path=PAGE) if request.path == "/" else request
        return http.answer(socket, page, policy, status=None)

    listener = Listener(SocketLimiter(Counter()), answer, server.serve_page, MAX_COMMAND_BYTES)
    async with listener.listen(HOST, port) as bound:
        yield bound
