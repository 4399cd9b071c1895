"""A client of protocol v1, built on websockets and msgspec without the service's own code.

    import asyncio
    from hapticvlm.client import connect

    async def main():
        async with connect("ws://127.0.0.1:8790/", name="my study") as client:
            await client.scene([{"object_id": "table", "name": "Oak_Table_02"}], ambient_c=21.0)
            await client.touch("contact", "table", speed_mps=0.3)
            for _ in range(10):  # renew within 250 ms, else the outputs stop
                await asyncio.sleep(0.1)
                await client.touch("slide", "table", speed_mps=0.1)
            await client.touch("release", "table")
            while not client.events.empty():
                print(client.events.get_nowait())

    asyncio.run(main())

Messages are dictionaries; `schemas/messages.schema.json` and `docs/protocol.md` define their
fields. Answers are returned to the caller that sent the request, and every other message of the
service goes to `Client.events`. A refused request raises `Refused`.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import ssl
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import msgspec
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed

from hapticvlm import __version__
from hapticvlm.errors import HapticVLMError, UsageError

URL = "ws://127.0.0.1:8790/"
Message = dict[str, Any]
MAX_EVENTS = 4096  # older events are dropped for newer ones
LONGEST_TOUCH_S = 900.0  # after which the plate rests, however it is touched
RENEWALS = 3  # of a lease while it lasts, so that two late ones do not end it

logger = logging.getLogger(__name__)


class Connection(ClientConnection):
    """A WebSocket that may end while its last bytes are being sent.

    asyncio does not mark a transport that ends in this way as closed, and the `abort` that
    websockets calls at the end of `send` and `close` would raise AttributeError (CPython
    gh-156512).
    """

    def connection_lost(self, exc: Exception | None) -> None:
        """Close, and make any later abort do nothing."""
        super().connection_lost(exc)
        self.transport.abort = lambda: None  # type: ignore[method-assign]


class Refused(HapticVLMError):
    """Raised when the service answers a request with `error`.

    - `code`: the kind of error: `message` (a wrong field), `limit` (out of range), `protocol` (not
      allowed in this state or role), `overload` (too much waits), `unsafe` (a stop holds the
      outputs), `not_owner` (another scene owns the outputs), `device` or `model` (one fails).
    - `path`: the field at fault, such as `$.objects[0].material`; None where there is none.

    `str(error)` is the code and the service's explanation.
    """

    def __init__(self, answer: Message) -> None:
        super().__init__(f"{answer['code']}: {answer['text']}")
        self.code: str = answer["code"]
        self.path: str | None = answer.get("path")


class Disconnected(HapticVLMError, ConnectionError):
    """Raised where there is no connection to a service, or no longer; the text says what to do."""


class TouchEnded(HapticVLMError):
    """Raised when a touch reached its longest time before its block ended."""


@dataclass(slots=True)
class Hand:
    """The motion of a touching hand: speed in m/s and force in N. A change holds from now on."""

    speed_mps: float
    force_n: float


class Client:
    """An open connection; `connect` returns one.

    - `welcome`: the service's answer to hello, with its limits, devices, models and materials.
    - `events`: messages that answer no request, such as `decision`, `telemetry` and `error`.
    - `events_lost`: how many events were dropped because `events` held MAX_EVENTS of them.

    Its methods may be called from several tasks at a time. After the connection has ended they
    raise `Disconnected`, also a request that still waits.
    """

    def __init__(self, socket: ClientConnection, welcome: Message) -> None:
        self.welcome = welcome
        self.events: asyncio.Queue[Message] = asyncio.Queue(MAX_EVENTS)
        self.events_lost = 0
        self._socket = socket
        self._ids = itertools.count(2)
        self._waiting: dict[int, asyncio.Future[Message]] = {}

    async def send(self, type: str, **fields: Any) -> asyncio.Future[Message]:
        """Send one message without waiting for its answer.

        - `type`: the type of the message, such as `touch`.
        - `fields`: its other fields except `id`; a field that is None is left out.

        Returns a future of the answer, which may be an `error` message. Use it to renew touches or
        send frames at a fixed pace.

            answer = await client.send("frame", image=jpeg, width=448, height=448, format="jpeg",
                                       origin="top", captured_at=time.monotonic())
            ...
            print((await answer)["type"])
        """
        id = next(self._ids)
        answer: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._waiting[id] = answer
        present = {name: value for name, value in fields.items() if value is not None}
        try:
            await self._socket.send(_encode({"type": type, "id": id, **present}))
        except ConnectionClosed as error:
            self._waiting.pop(id, None)
            raise ended(error) from None
        return answer

    async def request(self, type: str, **fields: Any) -> Message:
        """Send one message, as `send` does, and wait for its answer.

        Raises `Refused` if the answer is `error`. There is no timeout: a service answers every
        message. Use `asyncio.timeout` to set one.

            await client.request("set", ownership="take")
        """
        answer = await (await self.send(type, **fields))
        if answer["type"] == "error":
            raise Refused(answer)
        return answer

    async def scene(
        self, objects: list[Message], *, replace: bool = True, **fields: Any
    ) -> Message:
        """Declare the objects of the scene.

        - `objects`: a dictionary for each object: `object_id`, and what is known of `name`,
          `material`, `temperature_c`, `shader`, `thickness_m` (m), `sunlit`, `vibrates`,
          `stands_on` and `surfaces`, a dictionary for each of its surfaces, the largest first:
          `name`, `material` and `shader`.
        - `replace`: True (the default) makes these all objects of the scene; False adds or updates
          them and keeps the others.
        - `fields`: `forget`, a list of ids of removed objects; `ambient_c`, the air temperature in
          degC; `materials`, a list of all materials that objects of this scene can have.

        Returns the answer. Its `left_out` names each part that was not taken as sent, such as an
        unknown material, with `path` and `text`; it is absent if all was. The rest is felt. Each
        is logged as a warning, too. Raises `Refused` if nothing of the scene is usable.

            await client.scene([{"object_id": "cup", "material": "ceramic", "temperature_c": 50.0}])
        """
        answer = await self.request("scene", objects=objects, replace=replace, **fields)
        for part in answer.get("left_out", ()):
            logger.warning("%s: %s", part["path"], part["text"])
        return answer

    async def touch(
        self,
        phase: str,
        object_id: str | None = None,
        *,
        speed_mps: float = 0.0,
        force_n: float = 0.0,
        **fields: Any,
    ) -> Message:
        """Send the state of a hand; it renews the hand's lease on the outputs for 250 ms.

        - `phase`: `approach`, `contact`, `slide` or `release`.
        - `object_id`: the touched object. It or the field `region` is required, except for
          `release` and a swing.
        - `speed_mps`: speed of the hand relative to the surface in m/s; at `contact` the speed of
          the impact (default 0).
        - `force_n`: force of the hand in N (default 0).
        - `fields`: `hand`, `left` or `right` (default); `interaction`, such as `tap` or `swing`;
          `surface`, an index into the object's `surfaces` (default 0, the largest); `region`, a
          part of the newest frame; `distance_m` and `closing_mps` of an approach;
          `captured_at` in s (default: now).

        Raises `Refused`, for example with the code `unsafe` while a stop holds the outputs, or
        `not_owner` when another scene owns them.

            await client.touch("contact", "cup", speed_mps=0.3, force_n=1.5, hand="left")
        """
        message = {"hand": "right", "captured_at": time.monotonic(), **fields}
        return await self.request(
            "touch",
            phase=phase,
            object_id=object_id,
            speed_mps=speed_mps,
            force_n=force_n,
            **message,
        )

    @asynccontextmanager
    async def touching(
        self,
        object_id: str,
        *,
        speed_mps: float = 0.1,
        force_n: float = 1.0,
        longest_s: float = 60.0,
        **fields: Any,
    ) -> AsyncIterator[Hand]:
        """Touch an object until the block ends: contact, renewals of the lease, release.

        - `object_id`: the touched object.
        - `speed_mps`, `force_n`: of the hand in m/s and N, also of the impact at contact. The
          block may change them in the `Hand` that it gets. At a speed of 0 the hand is still.
        - `longest_s`: the touch ends after this many seconds (at most 900) even if the block goes
          on, so that a program that hangs does not drive the outputs for ever.
        - `fields`: others of `touch`, such as `hand` or `interaction`.

        A task of the event loop renews the lease: code that holds the loop for longer than a lease
        (250 ms) ends the touch, and so does the end of the process.

        Raises `Refused` at the contact. At the end of the block it raises what ended the touch
        early: `Refused` (`unsafe` after a stop: the touch does not begin again by itself),
        `TouchEnded` after `longest_s`, or `Disconnected`.

            async with client.touching("cup", speed_mps=0.2) as hand:
                await asyncio.sleep(1.0)
                hand.speed_mps = 0.4
                await asyncio.sleep(1.0)
        """
        if not 0.0 < longest_s <= LONGEST_TOUCH_S:
            limit = f"is not within 0..{LONGEST_TOUCH_S:g} s"
            raise UsageError(f"longest_s: {longest_s} {limit}; touch again for longer")
        hand = Hand(speed_mps, force_n)
        await self._move(hand, "contact", object_id, fields)
        renewing = asyncio.create_task(self._renew(hand, object_id, fields, longest_s))
        try:
            yield hand
        finally:
            renewing.cancel()
            await asyncio.wait({renewing})
            with suppress(Disconnected, Refused):
                await self._release(fields)
        if not renewing.cancelled():
            renewing.result()

    async def _renew(self, hand: Hand, object_id: str, fields: Message, longest_s: float) -> None:
        """Renew a touch until it is refused, or release it and raise TouchEnded."""
        period_s = self.welcome["limits"]["lease_ms"] / 1000.0 / RENEWALS
        with suppress(TimeoutError):
            async with asyncio.timeout(longest_s):
                while True:
                    await asyncio.sleep(period_s)
                    phase = "slide" if hand.speed_mps > 0.0 else "contact"
                    await self._move(hand, phase, object_id, fields)
        await self._release(fields)
        problem = f"the touch of {object_id} ended after longest_s, {longest_s:g} s"
        raise TouchEnded(f"{problem}; give a longer one, up to {LONGEST_TOUCH_S:g}")

    async def _move(self, hand: Hand, phase: str, object_id: str, fields: Message) -> None:
        motion = {"speed_mps": hand.speed_mps, "force_n": hand.force_n}
        await self.touch(phase, object_id, **motion, **fields)

    async def _release(self, fields: Message) -> None:
        await self.touch("release", hand=fields.get("hand", "right"))

    async def frame(self, image: bytes, width: int, height: int, **fields: Any) -> Message:
        """Send a picture and return the answer, `decision` or `skipped`.

        - `image`: the encoded picture; 448 x 448 px as JPEG is enough.
        - `width`, `height`: its size in px.
        - `fields`: `format`, `jpeg` (default), `png`, `rgb8`, `rgba8` or `bgra8`; `origin`, the
          row that comes first, `top` (default) or `bottom`; `object_id`, the object it shows, and
          `surface`, the index of the surface; `mask`, a PNG of the same size that is nonzero on
          the object, or `region`, a rectangle around it;
          `purpose`; `max_age_ms`; `captured_at` in s (default: now).

        Raises `Refused`, for example for a picture that cannot be decoded.

            decision = await client.frame(jpeg, 448, 448, object_id="cup")
            print(decision["type"], decision.get("material"))
        """
        message = {"format": "jpeg", "origin": "top", "captured_at": time.monotonic(), **fields}
        return await self.request("frame", image=image, width=width, height=height, **message)

    async def set(self, **fields: Any) -> Message:
        """Change settings of this session; a field that is left out stays as it is.

        - `ambient_c`: air temperature of the scene in degC.
        - `vibration_gain`, `thermal_gain`: 0..1; only for the owner of the outputs.
        - `feel`: the form in which each hand gets `vibration` events; only for the owner.
        - `watch`: the kinds of `view` events to send; only for observers.
        - `ownership`: take the outputs, give them up, or end the owner's connection.

        Raises `Refused` for a setting that this connection may not change.

            await client.set(vibration_gain=0.5)
        """
        return await self.request("set", **fields)

    async def stop(self, scope: str = "all") -> Message:
        """Stop the outputs at once, whichever scene drives them.

        - `scope`: `all` (default), `speaker` or `peltier`.

        They stay off until the owner sends `release` for the hand and then a new `approach` or
        `contact`. Any connection may stop, also an observer.
        """
        return await self.request("stop", scope=scope)

    async def close(self) -> None:
        """Close the connection; outputs that it owned come to rest. `connect` does so too."""
        await self._socket.close()

    async def wait_closed(self) -> None:
        """Wait until the connection has ended, by either side."""
        await self._socket.wait_closed()

    @property
    def has_ended(self) -> bool:
        """Whether the connection has ended, by either side."""
        return self._socket.close_code is not None

    async def listen(self) -> None:
        """Deliver answers and events until the connection ends; `connect` runs it as a task."""
        end = ended(None)
        try:
            async for data in self._socket:
                self._deliver(_decode(data))
        except ConnectionClosed as error:
            end = ended(error)
        finally:
            for answer in self._waiting.values():
                if not answer.done():
                    answer.set_exception(end)
                    answer.exception()
            self._waiting.clear()
            await self._socket.close()  # else a task that still sends would wait for ever

    def _deliver(self, message: Message) -> None:
        answer = self._waiting.pop(message["id"], None) if message["id"] else None
        if answer is not None:
            if not answer.done():
                answer.set_result(message)
            return
        if self.events.full():
            self.events.get_nowait()
            self.events_lost += 1
        self.events.put_nowait(message)


def ended(error: ConnectionClosed | None) -> Disconnected:
    """Return the error of a connection that has ended, with the service's own reason if any."""
    reason = "" if error is None or error.rcvd is None else error.rcvd.reason
    said = f" ({reason})" if reason else ""
    cure = "connect again; if it has stopped, start it by `hapticvlm serve` or hapticvlm.serve()"
    return Disconnected(f"the connection to the service has ended{said}: {cure}")


def trusting(ca: Path) -> ssl.SSLContext:
    """Return a value of `tls` for `connect` that trusts the certificate authority in a PEM file.

    Raises OSError if the file cannot be read, `ssl.SSLError` (an OSError) if it has no certificate.

        async with connect("wss://vr-lab.local:8790/", tls=trusting(Path("authority.pem"))):
            ...
    """
    ca.stat()  # OpenSSL would not name a file that is missing
    return ssl.create_default_context(cafile=ca)


@asynccontextmanager
async def connect(
    url: str = URL,
    *,
    name: str = "hapticvlm-python",
    role: str = "scene",
    token: str | None = None,
    tls: ssl.SSLContext | None = None,
) -> AsyncIterator[Client]:
    """Open a connection to a service, and close it when the context ends.

    - `url`: address of the service, as `hapticvlm serve` prints it; `ws://`, or `wss://` with TLS.
    - `name`: a name for this client, shown on the dashboard and in logs.
    - `role`: `scene` (default) declares objects and may own the outputs; `observer` watches
      decisions and telemetry, and may stop the outputs.
    - `token`: the token of a service that was started with one.
    - `tls`: the certificate authorities to trust for `wss://` (`trusting`); by default those of the
      system.

    Raises `Refused` if the service rejects the connection (a wrong token, or no free place),
    OSError if no service listens or its certificate is not trusted, and
    `websockets.exceptions.WebSocketException` if the address is not a service's.

        async with hapticvlm.connect(name="my study", token="SECRET") as client:
            print(client.welcome["materials"])
    """
    encrypted: dict[str, Any] = {} if tls is None else {"ssl": tls}
    async with open_socket(
        url,
        create_connection=Connection,
        compression=None,
        max_size=None,
        ping_interval=None,
        proxy=None,
        **encrypted,
    ) as socket:
        hello = {
            "type": "hello",
            "id": 1,
            "client": {"name": name, "version": __version__},
            "protocol": {"major": 1, "minor": 0},
            "role": role,
            **({"token": token} if token else {}),
        }
        await socket.send(_encode(hello))
        welcome = _decode(await socket.recv())
        if welcome["type"] == "error":
            raise Refused(welcome)
        client = Client(socket, welcome)
        listener = asyncio.create_task(client.listen())
        try:
            yield client
        finally:
            await socket.close()
            listener.cancel()
            with suppress(asyncio.CancelledError):
                await listener


def _encode(message: Message) -> bytes:
    """Encode a message as MessagePack. Raises TypeError for a value that no message has."""
    return msgspec.msgpack.encode(message, enc_hook=_plain)


def _decode(data: str | bytes) -> Message:
    """Decode a message of the service. Raises msgspec.DecodeError."""
    if isinstance(data, str):
        return msgspec.json.decode(data, type=Message)
    return msgspec.msgpack.decode(data, type=Message)


def _plain(value: object) -> object:
    """Return a number of numpy, or another kind of str, int or float, as the plain one."""
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value)
    raise TypeError(f"{type(value).__name__}: a message cannot have such a value")
