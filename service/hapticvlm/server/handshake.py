"""Admits connections: hello, its checks, a free slot, a session, welcome."""

from __future__ import annotations

import asyncio
import hmac
import itertools
import logging
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

from websockets.protocol import State

from hapticvlm import __version__
from hapticvlm.materials import Material
from hapticvlm.messages import (
    FRAMES_PER_S,
    LEASE_MS,
    MAX_MESSAGE_BYTES,
    MAX_SIDE_PX,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ClientMessage,
    Devices,
    Error,
    Hello,
    Limits,
    MessageError,
    Models,
    Party,
    Privacy,
    ProtocolVersion,
    SceneObject,
    SetpointRange,
    Welcome,
    encode,
)
from hapticvlm.partial_messages import decode
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.recordings.recorder import LateRecord, Recorder
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.rendering.heat.limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.server.access import Address
from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.connection import Connection
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limits import (
    GUESS_S,
    HELLO_S,
    LOOPBACK_SLOTS,
    MAX_CONNECTIONS,
    MAX_HELLO_BYTES,
    MAX_SCENES,
)
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.gateway import Gateway
from hapticvlm.session.decisions import Feel
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

CLOSE_PROTOCOL = 4000
CLOSE_MADE_ROOM = 4002
SERVER_FULL = f"{MAX_CONNECTIONS} connections are open already: close one"

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ServiceInfo:
    """The part of `welcome` that is the same for every client, and the settings of new sessions.

    `asks_elsewhere`: a VLM on another machine sees frames. `crops_elsewhere`: a shared recogniser
    on another machine sees crops of objects. `saved_materials` are materials by object id that a
    person set in an earlier run. Resistances are in m2 K/W.
    """

    devices: Devices
    models: Models
    table: Mapping[str, Material]
    asks_elsewhere: bool = False
    crops_elsewhere: bool = False
    recorder: Recorder | None = None
    saved_materials: Mapping[str, SceneObject] = field(default_factory=dict)
    contact_resistance: float | None = None
    plate_resistance: float = PLATE_RESISTANCE
    feel: Feel = "full"


class Handshake:
    """Admits connections to one gateway, with what `service_info` reports."""

    def __init__(
        self,
        address: Address,
        gateway: Gateway,
        service_info: ServiceInfo,
    ) -> None:
        self._address = address
        self._gateway = gateway
        self._service_info = service_info
        self._numbers = itertools.count(1)
        self._admission = AdmissionControl(gateway)

    async def welcome(self, socket: ClientSocket) -> Connection | None:
        """Wait for hello; answer welcome, or an error and close.

        A connection without a slot does not join the gateway: it may only stop the outputs.
        """
        as_text = False
        try:
            async with asyncio.timeout(HELLO_S):
                data = await socket.recv()
            as_text = isinstance(data, str)
            if len(data) > MAX_HELLO_BYTES:
                raise MessageError("protocol", f"hello is at most {MAX_HELLO_BYTES} bytes")
            hello = self._admit(decode(data, ()).message)
            has_slot = self._admission.find(hello, socket.remote_address[0])
        except TimeoutError:
            error = MessageError("protocol", f"no hello within {HELLO_S:.0f} s")
        except MessageError as refused:
            error = refused
        else:
            socket.mark_admitted()
            return self._open(socket, hello, as_text=as_text, has_slot=has_slot)
        if error.path == "$.token":
            await self.slow_guess(socket.remote_address[0])
        self._gateway.refuse(error.code)
        text = error.text if error.code == "protocol" else f"before hello: {error.text}"
        answer = Error(id=error.id, code="protocol", text=text, path=error.path)
        socket.write(encode(answer, as_text=as_text))
        socket.close(CLOSE_PROTOCOL, "hello first")
        return None

    def _admit(self, message: ClientMessage) -> Hello:
        """Return the hello if protocol and token are right. Raises MessageError."""
        if not isinstance(message, Hello):
            text = "send hello first: {type: hello, id, client, protocol, role}"
            raise MessageError("protocol", text, path="$.type", id=message.id)
        theirs = message.protocol
        ours = f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}"
        if theirs.major != PROTOCOL_MAJOR:
            text = (
                f"client speaks protocol {theirs.major}.{theirs.minor}, this service {ours}: "
                "use versions with the same major number"
            )
            raise MessageError("protocol", text, path="$.protocol.major", id=message.id)
        wanted = self._address.token
        given = message.token or ""
        if wanted is not None and not hmac.compare_digest(given.encode(), wanted.encode()):
            text = "wrong or missing token: send the one the service was started with"
            raise MessageError("protocol", text, path="$.token", id=message.id)
        return message

    async def slow_guess(self, peer: str) -> None:
        """Count and log a wrong token, and delay its sender."""
        self._gateway.counts[Count.REFUSED_TOKEN] += 1
        logger.warning("a wrong token from %s", peer)
        await asyncio.sleep(GUESS_S)

    def _open(
        self, socket: ClientSocket, hello: Hello, *, as_text: bool, has_slot: bool
    ) -> Connection | None:
        if socket.state is not State.OPEN:
            return None
        observer = hello.role == "observer"
        session = self._session(observer=observer)
        name = f"{hello.client.name[:40]!r} #{next(self._numbers)}"
        connection = Connection(socket, name, session, as_text=as_text, has_slot=has_slot)
        if has_slot:
            self._gateway.join(connection)
        logger.info("%s connected as %s, owner: %s", name, hello.role, session.owner)
        connection.send(self._welcome_message(hello, session))
        return connection

    def _session(self, *, observer: bool) -> SceneSession:
        """Begin a session; a scene's is recorded when sessions are kept."""
        self._gateway.ownership.free_if_owner_closes()
        outputs = self._gateway.outputs
        settings = SessionSettings(
            owner=not observer and self._gateway.owner is None,
            observer=observer,
            reading=outputs.reading,
            table=self._service_info.table,
            saved_materials=self._service_info.saved_materials,
            can_ask=self._service_info.models.vlm is not None,
            contact_resistance=self._service_info.contact_resistance,
            plate_resistance=self._service_info.plate_resistance,
            thermal_gain=outputs.thermal_gain,
            feel=self._service_info.feel,
        )
        if self._service_info.recorder is None or observer:
            return SceneSession(settings, outputs.hold)
        begin = partial(self._service_info.recorder.begin, recorded.head(settings, outputs.hold))
        return RecordedSession(settings, outputs.hold, write_line=LateRecord(begin))

    def _welcome_message(self, hello: Hello, session: SceneSession) -> Welcome:
        return Welcome(
            id=hello.id,
            service=Party(name="hapticvlm", version=__version__),
            protocol=ProtocolVersion(major=PROTOCOL_MAJOR, minor=PROTOCOL_MINOR),
            session=secrets.token_hex(8),
            owner=session.owner,
            limits=Limits(
                message_bytes=MAX_MESSAGE_BYTES,
                pixels=MAX_SIDE_PX,
                frames_per_s=FRAMES_PER_S,
                lease_ms=LEASE_MS,
                setpoint_c=SetpointRange(low=SETPOINT_MIN_C, high=SETPOINT_MAX_C),
            ),
            devices=self._service_info.devices,
            models=self._service_info.models,
            materials=list(self._service_info.table),
            privacy=Privacy(
                frames_stored=self._service_info.recorder is not None
                and self._service_info.recorder.keeps_frames,
                frames_leave_machine=self._service_info.asks_elsewhere
                or not is_loopback(self._address.host),
                crops_leave_machine=self._service_info.crops_elsewhere,
            ),
        )


class AdmissionControl:
    """Admits clients to the slots of one gateway."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway

    def find(self, hello: Hello, peer: str) -> bool:
        """Return whether a slot is free. Raises MessageError for a scene without one.

        An observer without a slot is admitted all the same, to stop the outputs: that must work
        for everybody at any time.
        """
        if hello.role == "scene":
            self._check_scenes(hello)
        if self._has_slot(hello, peer):
            return True
        self._gateway.counts[Count.REFUSED_SERVER_FULL] += 1
        if hello.role == "scene":
            raise MessageError("protocol", SERVER_FULL, id=hello.id)
        return False

    def _check_scenes(self, hello: Hello) -> None:
        scenes = sum(not each.session.observer for each in self._gateway.connections)
        if scenes >= MAX_SCENES:
            self._gateway.counts[Count.REFUSED_SERVER_FULL] += 1
            text = f"{MAX_SCENES} scenes are connected already: close one, or connect as observer"
            raise MessageError("protocol", text, path="$.role", id=hello.id)

    def _has_slot(self, hello: Hello, peer: str) -> bool:
        """Whether a slot is free, or the oldest of the idle observers makes room.

        The last slots are kept for observers on this machine, so that a crowd cannot lock the
        dashboard out.
        """
        is_kept_for = hello.role == "observer" and is_loopback(peer)
        places = MAX_CONNECTIONS if is_kept_for else MAX_CONNECTIONS - LOOPBACK_SLOTS
        taken = [each for each in self._gateway.connections if each.is_open]
        if len(taken) < places:
            return True
        idle = next((each for each in taken if each.is_idle), None)
        if idle is None:
            return False
        self._gateway.counts[Count.CLOSED_MADE_ROOM] += 1
        idle.end("made room for another client", CLOSE_MADE_ROOM)
        return True
