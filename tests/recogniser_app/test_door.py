"""Strangers at the shared recogniser: silent sockets in hundreds, and a log that nobody reads."""

import asyncio
import contextlib
import http.client
import os
import socket
import subprocess
import sys
import time

import psutil
import pytest
import uvicorn
from pace import PACE
from uvicorn.server import ServerState

import hapticvlm_recogniser_app.door as door_module
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app.door import STRANGER_S, Door, Strangers
from hapticvlm_recogniser_app.settings import ADMITTED, TOKEN

SECRET = "the-token-of-this-test"
CROWD = 600
MOST_FILES = 320
MIB = 2**20
SAID = {
    "nothing": b"",
    "half a header": b"GET /v1/identity HTTP/1.1\r\nHost: x\r\nX: ",
    "half a body": b"POST /v1/recognise HTTP/1.1\r\nHost: x\r\nContent-Length: 99999\r\n\r\n"
    + b"a" * 999,
    "rubbish": b"\x00\xff\r\n\r\n",
}

pytestmark = [pytest.mark.process, pytest.mark.needs_toolchain("uvicorn")]


@pytest.fixture(scope="module")
def app():
    """The process and its port; after the first line its log is not read."""
    command = [sys.executable, "-m", "hapticvlm", "recogniser-app", "--port", "0"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, TOKEN: SECRET},
        text=True,
    )
    assert process.stdout is not None
    with process.stdout:
        said = process.stdout.readline()
        yield process, int(said.strip().rstrip("/").rsplit(":", 1)[1])
        process.kill()
        process.wait()


def ask(port, path, token=None):
    """The status of one request."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0 * PACE)
    headers = {} if token is None else {"Authorization": f"Bearer {token}"}
    connection.request("GET", path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


def stranger(port, data):
    """A socket that says `data` and stays."""
    one = socket.create_connection(("127.0.0.1", port), 10.0 * PACE)
    with contextlib.suppress(OSError):  # it has made room already
        one.sendall(data)
    return one


@pytest.mark.parametrize("said", SAID)
def test_a_crowd_of_strangers_keeps_no_client_out(app, said):
    process, port = app
    before = psutil.Process(process.pid).memory_info().rss
    crowd = [stranger(port, SAID[said]) for _ in range(CROWD)]
    try:
        for _ in range(3):
            assert ask(port, contract.IDENTITY, SECRET) == 200
            assert ask(port, contract.HEALTH) == 200
        assert ask(port, contract.IDENTITY) == 401
        assert psutil.Process(process.pid).num_fds() < MOST_FILES
        assert psutil.Process(process.pid).memory_info().rss - before < 64 * MIB
    finally:
        for one in crowd:
            one.close()


@contextlib.asynccontextmanager
async def door_of_one():
    """A door whose application takes a while to answer, and both ends of its one socket."""

    async def answer(scope, _receive, send):
        scope[ADMITTED] = "a client" if scope["path"] == "/client" else None
        await asyncio.sleep(0.01)
        await send({"type": "http.response.start", "status": 401, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    http = type("OwnDoor", (Door,), {"strangers": Strangers()})
    config = uvicorn.Config(
        answer, http=http, ws="none", lifespan="off", log_config=None, timeout_keep_alive=3600
    )
    config.load()
    door = http(config=config, server_state=ServerState(), app_state={})
    server = await asyncio.get_running_loop().create_server(lambda: door, "127.0.0.1", 0)
    async with server:
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
        yield door, reader, writer
        writer.close()


async def test_a_refused_body_does_not_stay_with_its_socket():
    async with door_of_one() as (door, reader, writer):
        writer.write(SAID["half a body"])
        assert b"401" in await asyncio.wait_for(reader.readline(), 10.0 * PACE)
        assert not door.cycle.body


async def test_a_socket_is_a_clients_from_request_to_request(monkeypatch):
    monkeypatch.setattr(door_module, "STRANGER_S", 0.2)
    async with door_of_one() as (_, reader, writer):
        for path in (b"/client", b"/client", b"/stranger"):
            writer.write(b"GET %s HTTP/1.1\r\nHost: x\r\n\r\n" % path)
            await asyncio.wait_for(reader.readuntil(b"0\r\n\r\n"), 10.0 * PACE)
            if path == b"/client":
                await asyncio.sleep(0.6)
                assert not reader.at_eof()
        assert await asyncio.wait_for(reader.read(), 10.0 * PACE) == b""


def test_a_client_keeps_its_socket_while_a_stranger_loses_it(app):
    _, port = app
    client = http.client.HTTPConnection("127.0.0.1", port, timeout=30.0 * PACE)
    client.request("GET", contract.IDENTITY, headers={"Authorization": f"Bearer {SECRET}"})
    client.getresponse().read()
    first = client.sock
    with stranger(port, SAID["half a header"]) as silent:
        silent.settimeout(30.0 * STRANGER_S)
        began = time.monotonic()
        with contextlib.suppress(ConnectionResetError):
            assert silent.recv(1) == b""
        assert time.monotonic() - began > 0.5 * STRANGER_S
    client.request("GET", contract.IDENTITY, headers={"Authorization": f"Bearer {SECRET}"})
    assert client.getresponse().status == 200
    assert client.sock is first
    client.close()
