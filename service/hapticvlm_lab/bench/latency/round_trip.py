"""Round trips of touches and of echoes: one client's end, the floor beside it, its priority."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgpack
from websockets.asyncio.client import ClientConnection

from hapticvlm import __version__
from hapticvlm.commands.local_service import Service

CLIENT_PRIORITY = 5


def touch(number: int) -> dict[str, Any]:
    """Return touch `number` of a hand: contact, 18 slides and a release, over and over."""
    step = number % 20
    phase = "contact" if step == 0 else "release" if step == 19 else "slide"
    return {
        "type": "touch",
        "id": number + 10,
        "phase": phase,
        "object_id": "table",
        "hand": "right",
        "speed_mps": 0.1 + 0.01 * step,
        "force_n": 1.5,
        "captured_at": time.monotonic(),
    }


async def round_trip(socket: ClientConnection, data: bytes, id: int) -> float:
    """Return the time in ms until the message with this id comes back."""
    started = time.perf_counter()
    await socket.send(data)
    while True:
        answer = msgpack.unpackb(await socket.recv())
        if answer["id"] == id:
            if answer["type"] == "error":
                raise RuntimeError(answer["text"])
            return (time.perf_counter() - started) * 1000.0


async def introduce(socket: ClientConnection) -> None:
    """Send hello as a scene with one table of wood."""
    client = {"name": "measure latency", "version": __version__}
    protocol = {"major": 1, "minor": 0}
    table = {"object_id": "table", "material": "wood"}
    for message in (
        {"type": "hello", "id": 1, "client": client, "protocol": protocol, "role": "scene"},
        {"type": "scene", "id": 2, "objects": [table], "replace": True},
    ):
        await round_trip(socket, msgpack.packb(message), int(str(message["id"])))


@contextmanager
def echo(realtime: bool) -> Iterator[int]:
    """Run a bare echo in a process of its own; yields its port."""
    command = [sys.executable, "-m", "hapticvlm_lab.bench.latency.echo", *(["realtime"] * realtime)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.kill()


@contextmanager
def priority(realtime: bool) -> Iterator[None]:
    """Give the measuring client the same kind of priority; children start without it."""
    if not realtime:
        yield
        return
    flags = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    os.sched_setscheduler(0, flags, os.sched_param(CLIENT_PRIORITY))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def is_priority_permitted() -> bool:
    """Return whether this system permits real-time priority."""
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        with priority(True):
            return True
    except OSError:
        return False


def service_status(service: Service) -> dict[str, Any]:
    """Return the service's page `/status`."""
    with urllib.request.urlopen(service.page + "status", timeout=5) as answer:
        found: dict[str, Any] = json.load(answer)
    return found
