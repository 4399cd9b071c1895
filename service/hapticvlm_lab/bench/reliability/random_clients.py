"""Random clients of the service, legal and not, that account for the answers to their requests.

One random generator drives all of them: a seed gives the same requests in the same order again.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from PIL import Image
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed

Message = dict[str, Any]

OBJECTS = ("table", "kettle", "window", "thing")
MATERIALS = ("wood", "metal", "glass", "unknown")
PHASES = ("approach", "contact", "contact", "slide", "slide", "release")
HANDS = ("left", "right")
SIDE = 96
ANSWERED_S = 10.0  # bound for every answer, however busy the machine
ROLES = ("scene", "scene", "observer")


@dataclass(frozen=True, slots=True)
class Request:
    """A request that waits for its answer."""

    id: int
    what: str
    at: float
    answer: asyncio.Future[Message]


@dataclass(slots=True, eq=False)
class RandomClient:
    """One connection, its open requests, and whether it believes to own the outputs."""

    name: str
    role: str
    socket: ClientConnection
    is_owner: bool = False
    asked: dict[int, Request] = field(default_factory=dict)  # by id, until they are answered
    answered: int = 0
    faults: list[str] = field(default_factory=list)
    next_id: int = 1

    @property
    def is_open(self) -> bool:
        """Whether the connection is open."""
        return self.socket.close_code is None

    async def ask(self, **message: Any) -> Request:
        """Send one request. A connection that closes is not a fault."""
        number = self.next_id
        self.next_id += 1
        answer: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        what = str(message.get("ownership") or message.get("type"))[:20]
        asked = Request(number, what, time.monotonic(), answer)
        self.asked[number] = asked
        with contextlib.suppress(ConnectionClosed):
            await self.socket.send(msgspec.msgpack.encode({"id": number, **message}))
        return asked

    async def send(self, data: bytes) -> None:
        """Send bytes that need not be a message; they are answered with id 0, or not at all."""
        with contextlib.suppress(ConnectionClosed):
            await self.socket.send(data)

    async def read(self) -> None:
        """Account for every message, until the connection ends."""
        with contextlib.suppress(ConnectionClosed):
            async for data in self.socket:
                assert isinstance(data, bytes)
                self.account(msgspec.msgpack.decode(data))

    def account(self, message: Message) -> None:
        """Note one message: an answer closes its request, and only one may."""
        number, kind = message["id"], message["type"]
        if kind in ("ownership", "welcome"):
            self.is_owner = bool(message["owner"])
        if number == 0:
            return
        # Popped, so that a second answer to the same request finds nothing and is a fault.
        asked = self.asked.pop(number, None)
        if asked is None:
            self.faults.append(f"{self.name}: {kind} answers {number}, which awaits no answer")
            return
        self.answered += 1
        if kind == "ok" and asked.what in ("take", "give"):  # no event follows for the asker itself
            self.is_owner = asked.what == "take"
        asked.answer.set_result(message)

    def overdue(self, now: float) -> list[str]:
        """Describe each request that was never answered."""
        late = [each for each in self.asked.values() if now - each.at > ANSWERED_S]
        return [
            f"{self.name}: {each.what} {each.id} has no answer" for each in late if self.is_open
        ]

    async def answer(self, **message: Any) -> Message | None:
        """Send a request and wait; None where the connection closes or no answer comes in time."""
        asked = await self.ask(**message)
        closing = asyncio.create_task(self.socket.wait_closed())
        await asyncio.wait(
            (asked.answer, closing), timeout=ANSWERED_S, return_when="FIRST_COMPLETED"
        )
        closing.cancel()
        return asked.answer.result() if asked.answer.done() else None


async def connect(
    url: str, number: int, rng: random.Random
) -> tuple[RandomClient, asyncio.Task[None]]:
    """Connect and send hello; returns the client and the task that reads for it."""
    socket = await open_socket(url, compression=None, ping_interval=None, max_size=None)
    client = RandomClient(f"client {number}", rng.choice(ROLES), socket)
    reading = asyncio.create_task(client.read())
    hello = {"client": {"name": client.name, "version": "1"}, "role": client.role}
    await client.ask(type="hello", protocol={"major": 1, "minor": 0}, **hello)
    return client, reading


def _touch(rng: random.Random) -> Message:
    motion = {"speed_mps": rng.uniform(0.0, 2.0), "force_n": rng.uniform(0.0, 10.0)}
    where: Message = {"object_id": rng.choice(OBJECTS)}
    if rng.random() < 0.2:
        where = {"region": {"x": 0.2, "y": 0.2, "w": rng.uniform(0.1, 0.7), "h": 0.5}}
    now = {"hand": rng.choice(HANDS), "captured_at": time.monotonic()}
    return {"type": "touch", "phase": rng.choice(PHASES), **where, **motion, **now}


def _scene(rng: random.Random) -> Message:
    objects = [
        {"object_id": name, "material": rng.choice(MATERIALS), "temperature_c": rng.uniform(0, 60)}
        for name in rng.sample(OBJECTS, rng.randint(1, 4))
    ]
    return {"type": "scene", "objects": objects, "replace": rng.random() < 0.5}


def _frame(rng: random.Random) -> Message:
    pixels = np.random.default_rng(rng.randrange(2**32)).integers(0, 255, (12, 12, 3), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(pixels).resize((SIDE, SIDE)).save(buffer, "JPEG")
    size = {"format": "jpeg", "width": SIDE, "height": SIDE, "origin": "top"}
    what = {"object_id": rng.choice(OBJECTS)} if rng.random() < 0.8 else {}
    taken = {"captured_at": time.monotonic(), "image": buffer.getvalue()}
    return {"type": "frame", **size, **what, **taken}


def _set(rng: random.Random) -> Message:
    choices: list[Message] = [
        {"vibration_gain": rng.random()},
        {"thermal_gain": rng.random()},
        {"ambient_c": rng.uniform(-10.0, 40.0)},
        {"ownership": "take"},
        {"ownership": "give"},
        {"watch": rng.sample(["frames", "waveform", "log"], rng.randint(0, 3))},
        {"feel": {"left": "amplitude", "right": "parametric"}},
    ]
    return {"type": "set", **rng.choice(choices)}


def _wrong(rng: random.Random) -> Message:
    choices: list[Message] = [
        {"type": "touch", "phase": "hit"},
        {**_touch(rng), "force_n": float("nan")},
        {**_touch(rng), "speed_mps": 1e300},
        {"type": "scene", "objects": [{"object_id": "x", "material": "kryptonite"}]},
        {"type": "scene", "objects": [{"object_id": 5}]},
        {**_frame(rng), "width": 5000},
        {**_frame(rng), "image": b"no picture"},
        {"type": "set", "vibration_gain": 2.0},
        {"type": "set", "nonsense": True},
        {"type": "stop", "scope": "everything"},
        {"type": "hello"},
        {"type": rng.choice(["", "jump", "welcome", "decision"])},
    ]
    return rng.choice(choices)


def garbage(rng: random.Random) -> bytes:
    """Return bytes that are not a message: they are answered with id 0."""
    pair = msgspec.msgpack.encode([1, 2])
    choices = (rng.randbytes(rng.randint(0, 200)), b"\x81" * 50, pair, b"\xc1")
    return rng.choice(choices)


# The requests of a client, with their weights.
REQUESTS: tuple[tuple[int, Callable[[random.Random], Message]], ...] = (
    (60, _touch),
    (8, _scene),
    (10, _frame),
    (8, _set),
    (8, _wrong),
)


def random_request(rng: random.Random) -> Message:
    """Return a random request."""
    (make,) = rng.choices([make for _, make in REQUESTS], [weight for weight, _ in REQUESTS])
    return make(rng)
