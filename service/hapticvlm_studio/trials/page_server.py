"""Serves the pages of a study on loopback: static files, and a WebSocket of JSON maps for each.

A page is sent the texts of all languages once, then the whole view after every change. It sends
what is to be done ({"do": ...}); what cannot be done is answered with {"refused": why}. The
participant's page is at `/`, the experimenter's at `/experimenter`: only that one is sent which
pattern was presented. Pages of other origins are refused, as by the service itself.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from hapticvlm import documents
from hapticvlm.client import Client, connect
from hapticvlm.server.web import http
from hapticvlm_studio.design import languages
from hapticvlm_studio.design.design import Design
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.conductor import Conductor
from hapticvlm_studio.trials.player import Player
from hapticvlm_studio.trials.record import Pace

HOST = "127.0.0.1"
PAGES = (Path(__file__).parents[1] / "pages", http.PAGES)  # ours, and what they share
PAGE = "/study.html"
EXPERIMENTER = "/experimenter.html"
EXPERIMENTER_SOCKET = "/experimenter"  # the WebSocket of the experimenter's page
OUTPUTS_EVERY_S = 0.5  # how often that page is sent the outputs
MAX_COMMAND_BYTES = 32_768


@dataclass(frozen=True, slots=True)
class Setting:
    """Where and how a study runs; url and token are of the service that plays the patterns."""

    folder: Path
    url: str
    port: int = 0
    pace: Pace = field(default_factory=Pace)
    settle_c: float = 0.8
    token: str | None = None


class StudyServer:
    """The pages that show one study, and what they ask of it."""

    def __init__(self, conductor: Conductor, greeting: dict[str, Any]) -> None:
        self._conductor = conductor
        self._greeting = json.dumps(greeting)
        self._pages: set[ServerConnection] = set()
        self._experimenters: set[ServerConnection] = set()
        self._turn = asyncio.Lock()
        conductor.notify = self._notify

    def _notify(self) -> None:
        broadcast(self._pages, json.dumps(self._conductor.view()))
        self._notify_experimenters()

    def _notify_experimenters(self) -> None:
        broadcast(self._experimenters, json.dumps(self._conductor.overview()))

    async def report_outputs(self) -> None:
        """Send the outputs to the experimenter's pages, until cancelled."""
        while True:
            await asyncio.sleep(OUTPUTS_EVERY_S)
            if self._experimenters:
                self._notify_experimenters()

    def play(self, waveform: dict[str, Any]) -> None:
        """Send the speaker's waveform to the participant's pages, which play it."""
        broadcast(self._pages, json.dumps({"waveform": waveform}))

    async def serve_page(self, socket: ServerConnection) -> None:
        """Serve one page until it leaves."""
        is_experimenter = socket.request is not None and socket.request.path == EXPERIMENTER_SOCKET
        pages = self._experimenters if is_experimenter else self._pages
        shown = self._conductor.overview() if is_experimenter else self._conductor.view()
        try:
            await socket.send(self._greeting)
            pages.add(socket)
            await socket.send(json.dumps(shown))
            async for data in socket:
                await self._receive(socket, data)
        except ConnectionClosed:
            pass
        finally:
            pages.discard(socket)

    async def _receive(self, socket: ServerConnection, data: bytes | str) -> None:
        try:
            command = documents.parse_json(data)
            if not isinstance(command, dict):
                raise StudyError("not a request")
            async with self._turn:
                await self._conductor.do(command)
        except (StudyError, ConnectionError, ConnectionClosed, ValueError) as error:
            await socket.send(json.dumps({"refused": str(error)}))


async def run(design: Design, setting: Setting, ready: Callable[[str], None]) -> None:
    """Run a study until cancelled or until the service goes; `ready` is given the page's address.

    Raises StudyError, Refused or OSError.
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
        _beside(stack, player.listen())
        conductor = Conductor(design, setting.folder, player, setting.pace)
        server = StudyServer(conductor, greeting)
        if setting.pace.hear:
            observer = connect(
                setting.url, name="study, heard", role="observer", token=setting.token
            )
            _beside(stack, _relay_waveform(await stack.enter_async_context(observer), server))
        _beside(stack, server.report_outputs())
        port = await stack.enter_async_context(_listening(server, setting.port))
        stack.push_async_callback(conductor.leave)
        ready(f"http://{HOST}:{port}{PAGE}")
        await _until_gone(client)


async def _relay_waveform(observer: Client, server: StudyServer) -> None:
    """Relay the service's stream of what the speaker plays, as its dashboard has it."""
    await observer.set(watch=["waveform"])
    while True:
        event = await observer.events.get()
        if event["type"] == "view" and event["kind"] == "waveform":
            server.play({name: event[name] for name in ("start", "samples", "rate_hz")})


async def _until_gone(client: Client) -> None:
    await client.wait_closed()
    raise StudyError("the service closed the connection; nothing is lost, start again to go on")


def _beside(stack: AsyncExitStack, work: Coroutine[Any, Any, None]) -> None:
    """Run `work` until the study ends."""
    stack.push_async_callback(_cancel, asyncio.create_task(work))


async def _cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


@asynccontextmanager
async def _listening(server: StudyServer, port: int) -> AsyncIterator[int]:
    policy = http.AccessPolicy(HOST, frozenset(), pages=PAGES)

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        asked = replace(request, path=PAGE) if request.path == "/" else request
        return http.answer(connection, asked, policy, dict)

    async with serve(
        server.serve_page,
        HOST,
        port,
        process_request=answer,
        compression=None,
        max_size=MAX_COMMAND_BYTES,
        close_timeout=1,
        server_header=None,
    ) as listening:
        yield listening.sockets[0].getsockname()[1]
