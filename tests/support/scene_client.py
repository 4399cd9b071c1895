"""A scene's client of a running service: its objects and pictures, and what it waits for."""

import asyncio
import io
import math
import subprocess
import sys
import textwrap
import time
import urllib.request

import numpy as np
from conftest import Peer, status
from pace import PACE
from PIL import Image

OBJECTS = [
    {"object_id": "table", "material": "wood"},
    {"object_id": "kettle", "material": "metal", "temperature_c": 5.0},
    {"object_id": "thing", "name": "Object_07"},
]
TRIES = 4


def picture(seed=0, side=64):
    coarse = np.random.default_rng(seed).integers(0, 255, (8, 8, 3), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(coarse).resize((side, side)).save(buffer, "JPEG", quality=90)
    return buffer.getvalue()


def frame(seed=0, **fields):
    given = {"format": "jpeg", "width": 64, "height": 64, "origin": "top", "image": picture(seed)}
    return {"type": "frame", "captured_at": time.monotonic(), **given, **fields}


async def owner_of(client: Peer) -> None:
    welcome = await client.hello()
    assert welcome["owner"]
    await client.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
    await client.touch("release")  # a stop of an earlier test holds until then


async def until(service, claim, seconds=15.0 * PACE):
    """Poll the status until `claim` holds; return how long it took."""
    started = time.monotonic()
    while not claim(status(service)):
        waited = time.monotonic() - started
        assert waited < seconds, "it never happened"
        pause_s = 0.005 if waited < 0.4 else 0.05 if waited < 2.0 else 0.2
        await asyncio.sleep(pause_s)  # a long wait must not busy the machine
    return time.monotonic() - started


async def quickest(service, begin, claim, limit_s):
    """Return the shortest wait for `claim` after `begin`, of up to TRIES until one is short enough.

    On a busy machine a single look at the status may come late; an output that rests too late
    does so each time.
    """
    took = math.inf
    for _ in range(TRIES):
        await begin()
        took = min(took, await until(service, claim))
        if took < limit_s:
            break
    return took


def is_silent(found):
    return found["speaker"]["level"] < 1e-4


def rests(found):
    return is_silent(found) and found["leases"] == 0


def get(service, path, **headers):
    request = urllib.request.Request(service.page.rstrip("/") + path, headers=headers)
    return urllib.request.urlopen(request, timeout=5 * PACE)


TOUCHING_CLIENT = """
    import asyncio, sys, time, msgpack, websockets

    async def main(url):
        async with websockets.connect(url, compression=None) as socket:
            async def ask(id, **message):
                await socket.send(msgpack.packb({"id": id, **message}))
                while msgpack.unpackb(await socket.recv())["id"] != id:
                    pass
            await ask(1, type="hello", client={"name": "victim", "version": "1"},
                      protocol={"major": 1, "minor": 0}, role="scene")
            kettle = {"object_id": "kettle", "material": "metal", "temperature_c": 5.0}
            await ask(2, type="scene", objects=[kettle], replace=True)
            for id in range(3, 10_000):
                await ask(id, type="touch", phase="slide" if id > 3 else "contact",
                          object_id="kettle", hand="right", speed_mps=0.4, force_n=2.0,
                          captured_at=time.monotonic())
                if id == 20:
                    print("touching", flush=True)
                await asyncio.sleep(0.02)

    asyncio.run(main(sys.argv[1]))
"""


def touching_client(service):
    """A client process in the middle of a slide."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(TOUCHING_CLIENT), service.url],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "touching\n"
    process.stdout.close()
    return process
