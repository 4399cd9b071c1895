"""A gateway on simulated devices without processes, its server, and clients without a network."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any, cast

import msgpack
from websockets.protocol import State

from hapticvlm.devices.plate.plate import Plate
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Device, Devices, Frame, Models
from hapticvlm.server.access import Address
from hapticvlm.server.connection import Connection
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.handshake import ServiceInfo
from hapticvlm.server.websocket import WebSocketServer
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import RecognitionRequest, RequestId, of_object
from hapticvlm.vision.worker import RecogniserSettings, RecogniserWorker

SIMULATED = Device(name="simulated", simulated=True)


def new_gateway(plate: Plate | None = None) -> Gateway:
    """Make a gateway whose engine and recogniser are never started."""
    worker = RecogniserWorker(RecogniserSettings())
    return Gateway(Speaker(AudioSettings()), plate or SimulatedPlate(), worker)


def server_of(gateway: Gateway) -> WebSocketServer:
    """Make what lets clients in to this gateway over real sockets, at any free port."""
    service_info = ServiceInfo(Devices(speaker=SIMULATED, peltier=SIMULATED), Models(), MATERIALS)
    return WebSocketServer(Address(port=0), gateway, service_info, time.monotonic)


class Peer:
    """Our end of a socket in memory: what the client says, then silence; what it is sent."""

    def __init__(self, *said: bytes | str, address: str = "127.0.0.1", gone: bool = False) -> None:
        self.remote_address = (address, 50_000)
        self.sent: list[dict[str, Any]] = []
        self.is_greeted = self.is_text = False
        self.state = State.CLOSED if gone else State.OPEN
        self.closed: tuple[int, str] | None = None
        self._said = list(said)
        self._next_posted: Callable[[], bytes | str | None] = lambda: None

    def mark_admitted(self) -> None:
        self.is_greeted = True

    async def recv(self) -> bytes | str:
        if not self._said:
            await asyncio.Future()
        return self._said.pop(0)

    def write(self, data: bytes | str) -> None:
        self.is_text = isinstance(data, str)
        self.sent.append(json.loads(data) if isinstance(data, str) else msgpack.unpackb(data))

    def post_from(self, next_posted: Callable[[], bytes | str | None]) -> None:
        self._next_posted = next_posted

    def posted(self) -> None:
        """Leave it waiting: `read` is the client that reads."""

    def read(self) -> None:
        """Read all that was posted."""
        while (data := self._next_posted()) is not None:
            self.write(data)

    def close(self, code: int, reason: str) -> None:
        self.closed = code, reason
        self.state = State.CLOSING


def join(gateway: Gateway, *, observer: bool = False, peer: Peer | None = None) -> Connection:
    """Let a client in, past its hello; the first scene is the owner."""
    is_owner = not observer and gateway.owner is None
    session = SceneSession(
        SessionSettings(
            owner=is_owner, observer=observer, thermal_gain=gateway.outputs.thermal_gain
        )
    )
    socket = cast("ClientSocket", peer or Peer())
    connection = Connection(socket, "test", session, as_text=False)
    gateway.join(connection)
    return connection


def look(key: str, purpose: Any = "live", size: int = 10, id: int = 1) -> RecognitionRequest:
    """Make a look at an object that a session wants recognised."""
    image = bytes(size)
    given: dict[str, Any] = {"format": "rgb8", "width": 1, "height": 1, "origin": "top"}
    frame = Frame(id=id, image=image, purpose=purpose, object_id=key, captured_at=0.0, **given)
    return RecognitionRequest(of_object(key), frame, RequestId(id))
