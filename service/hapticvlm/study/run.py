"""Serves the study page on loopback: static files, and one WebSocket of JSON maps.

A page sends what is to be done ({"do": ...}) and is sent the whole view after every change; what
cannot be done is answered with {"refused": why}. Pages of other origins are refused, as by the
service itself.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from hapticvlm import documents
from hapticvlm.client import Client, connect
from hapticvlm.server import http
from hapticvlm.study.conductor import Conductor
from hapticvlm.study.design import Design
from hapticvlm.study.player import Player
from hapticvlm.study.record import Pace
from hapticvlm.study.stimuli import StudyError

HOST = "127.0.0.1"
PAGE = "/study.html"
MAX_COMMAND_BYTES = 4096


@dataclass(frozen=True, slots=True)
class Setting:
    """Where and how a study runs; url and token are of the service that plays the patterns."""

    folder: Path
    url: str
    port: int = 0
    pace: Pace = field(default_factory=Pace)
    settle_c: float = 0.8
    token: str | None = None


class Room:
    """The pages that look at one study, and what they ask of it."""

    def __init__(self, conductor: Conductor) -> None:
        self._conductor = conductor
        self._pages: set[ServerConnection] = set()
        self._turn = asyncio.Lock()
        conductor.tell = self._tell

    def _tell(self) -> None:
        if self._pages:
            broadcast(self._pages, json.dumps(self._conductor.view()))

    async def attend(self, socket: ServerConnection) -> None:
        """Talk with one page until it leaves."""
        self._pages.add(socket)
        try:
            await socket.send(json.dumps(self._conductor.view()))
            async for data in socket:
                await self._take(socket, data)
        except ConnectionClosed:
            pass
        finally:
            self._pages.discard(socket)

    async def _take(self, socket: ServerConnection, data: bytes | str) -> None:
        try:
            command = documents.parse_json(data)
            if not isinstance(command, dict):
                raise StudyError("not a request")
            async with self._turn:
                await self._conductor.do(command)
        except (StudyError, ConnectionError, ConnectionClosed, ValueError) as error:
            await socket.send(json.dumps({"refused": str(error)}))


async def run(design: Design, setting: Setting, ready: Callable[[str], None]) -> None:
    """Run a study until cancelled or until the service goes; `ready` is told the page's address.

    Raises StudyError, Refused or OSError.
    """
    async with AsyncExitStack() as stack:
        client = await stack.enter_async_context(
            connect(setting.url, name="hapticvlm study", token=setting.token)
        )
        player = Player(client, setting.settle_c)
        await player.prepare(design.stimuli)
        stack.push_async_callback(_cancel, asyncio.create_task(player.listen()))
        conductor = Conductor(design, setting.folder, player, setting.pace)
        port = await stack.enter_async_context(_listening(Room(conductor), setting.port))
        stack.push_async_callback(conductor.leave)
        ready(f"http://{HOST}:{port}{PAGE}")
        await _until_gone(client)


async def _until_gone(client: Client) -> None:
    await client.wait_closed()
    raise StudyError("the service closed the connection; nothing is lost, start again to go on")


async def _cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


@asynccontextmanager
async def _listening(room: Room, port: int) -> AsyncIterator[int]:
    policy = http.AccessPolicy(HOST, frozenset(), has_study=True)

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        asked = replace(request, path=PAGE) if request.path == "/" else request
        return http.answer(connection, asked, policy, dict)

    async with serve(
        room.attend,
        HOST,
        port,
        process_request=answer,
        compression=None,
        max_size=MAX_COMMAND_BYTES,
        close_timeout=1,
        server_header=None,
    ) as server:
        yield server.sockets[0].getsockname()[1]
