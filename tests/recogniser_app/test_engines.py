"""A shared recogniser on uvicorn and on real Ray processes: killed, hung, asked for another's.

What every engine must do runs on both, what only replicas can runs on Ray.
"""

import asyncio
import http.client
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import pytest
from conftest import status
from in_process import hapticvlm
from pace import PACE
from ports import free_port
from shared_looks import is_shared, look, scene, until_shared
from toolchains import require

from hapticvlm.client.local_service import running
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app.settings import TOKEN

START_S, STOP_S = 240.0 * PACE, 60.0 * PACE
BACK_S = 120.0 * PACE  # for Ray to notice and replace a replica, on a busy machine
DEADLINE_S = 0.8
SECRET = "the-token-of-this-test"
QUEUE = ("--queue", "32")

pytestmark = pytest.mark.slow
RAY = pytest.param("ray", marks=pytest.mark.nightly)
on_ray = pytest.mark.parametrize("app", [RAY], indirect=True)
on_uvicorn = pytest.mark.parametrize("app", ["uvicorn"], indirect=True)


@dataclass
class App:
    """A running recogniser-app."""

    port: int

    @property
    def url(self):
        return f"http://127.0.0.1:{self.port}"

    def ask(self, verb, path, body=None, token=SECRET):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request(verb, path, body, {"Authorization": f"Bearer {token}"})
        response = connection.getresponse()
        data = response.read()
        connection.close()
        return response.status, data

    def health(self):
        found, data = self.ask("GET", contract.HEALTH)
        assert found == 200, data
        return json.loads(data)


@pytest.fixture(scope="module", params=["uvicorn", RAY])
def app(request):
    require(request.param)
    os.environ[TOKEN] = SECRET
    process, port, said = start(free_port(), request.param)
    try:
        assert any("ready on" in line for line in said), "".join(said)
        yield App(port)
    finally:
        stop(process)
        del os.environ[TOKEN]


def start(port, engine):
    """Start the app and wait until it is ready or has ended."""
    command = [sys.executable, "-m", "hapticvlm", "recogniser-app", "--port", str(port)]
    command += ["--engine", engine, *QUEUE]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    ready, said = threading.Event(), []

    def read():
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line)
            print(line, end="")
            if "ready on" in line:
                ready.set()
        process.wait()
        process.stdout.close()
        ready.set()

    threading.Thread(target=read, daemon=True).start()
    ready.wait(START_S)
    return process, port, said


def stop(process):
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def sharing(app):
    arguments = ["--recogniser-url", app.url, "--recogniser-deadline", str(DEADLINE_S)]
    with running(arguments) as service:
        yield service


def test_only_its_token_lets_in_and_its_health_is_open(app):
    assert app.ask("GET", contract.IDENTITY, token="wrong")[0] == 401
    assert app.ask("POST", contract.RECOGNISE, b"", token="wrong")[0] == 401
    assert app.ask("GET", contract.READY, token="wrong")[0] == 200
    assert app.ask("GET", contract.IDENTITY + "?gallery=arcade")[0] == 404
    assert app.ask("POST", contract.RECOGNISE, b"\xc1")[0] == 422
    assert app.ask("GET", "/")[0] == 404
    assert contract.read_identity(app.ask("GET", contract.IDENTITY)[1]).gallery == "shipped"


def test_what_comes_together_is_embedded_together(app):
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 255, (16, 224, 224, 3), np.uint8)
    bodies = [
        contract.write_request([Crop(one, central_mask(224))], wait_ms=60_000.0) for one in pixels
    ]
    identity = contract.read_identity(app.ask("GET", contract.IDENTITY)[1])
    began = time.monotonic()
    with ThreadPoolExecutor(16) as pool:
        answers = list(pool.map(lambda body: app.ask("POST", contract.RECOGNISE, body), bodies))
    took_ms = 1000.0 * (time.monotonic() - began)
    assert {found for found, _ in answers} == {200}
    read = [contract.read_answer(data, identity, 1)[0] for _, data in answers]
    assert max(answer.batch for answer in read) > 1
    assert all(0.0 < sum(answer.stages_ms.values()) <= took_ms for answer in read)
    assert sum(map(int, app.health()["batches"].values())) < app.health()["counts"]["crops"]


@on_ray
@pytest.mark.skipif(os.name != "posix", reason="priorities of POSIX")
def test_a_replica_takes_its_turn_beside_other_programs(app):
    ours, replica = (os.getpriority(os.PRIO_PROCESS, pid) for pid in (0, app.health()["pid"]))
    assert replica == ours  # Ray's own choice is 15: behind all others
    assert app.health()["nice"] == replica


@on_ray
async def test_a_killed_replica_is_bridged_here_and_replaced_by_ray(app, sharing):
    async with scene(sharing) as client:
        await until_shared(client, BACK_S)
        os.kill(app.health()["pid"], signal.SIGKILL)
        first = await until_here(client)
        assert first["type"] == "decision"
        await until_shared(client, BACK_S)
    assert status(sharing)["recogniser"]["restarts"] == 0


@on_ray
async def test_a_hung_replica_is_bridged_here_and_no_touch_waits(app, sharing):
    async with scene(sharing) as client:
        await until_shared(client, BACK_S)
        before = await touches_ms(client)
        pid = app.health()["pid"]
        os.kill(pid, signal.SIGSTOP)
        try:
            first = await look(client)
            assert not is_shared(first)
            during = await touches_ms(client)
        finally:
            with suppress(ProcessLookupError):  # Ray has replaced it by now
                os.kill(pid, signal.SIGCONT)
        assert statistics.median(during) < 3.0 * statistics.median(before) + 1.0
        await until_shared(client, BACK_S)


@on_uvicorn
async def test_another_identity_than_demanded_gets_no_crop(app):
    arguments = ["--recogniser-url", app.url, "--recogniser-hash", "0" * 16]
    before = await settled_crops(app)
    with running(arguments) as service:
        async with scene(service) as client:
            for _ in range(5):
                assert not is_shared(await look(client))
            while not (told := status(service)["recogniser"]["remote"])["reason"]:
                await look(client)
    assert "not 0000000000000000" in told["reason"]
    assert app.health()["counts"].get("crops", 0) == before


@on_uvicorn
async def test_a_service_is_answered_and_goes_on_alone_while_the_process_stands_still(app, sharing):
    async with scene(sharing) as client:
        await until_shared(client, BACK_S)
        pid = app.health()["pid"]
        os.kill(pid, signal.SIGSTOP)
        try:
            first = await until_here(client)
            assert first["type"] == "decision"
        finally:
            os.kill(pid, signal.SIGCONT)
        await until_shared(client, BACK_S)


@on_uvicorn
def test_more_requests_than_the_queue_holds_are_refused_at_once_and_health_is_not(app):
    waiting = [socket.create_connection(("127.0.0.1", app.port), timeout=30) for _ in range(32)]
    head = (
        f"POST {contract.RECOGNISE} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {SECRET}\r\n"
        "Content-Length: 1000\r\n\r\n"
    )
    try:
        for one in waiting:
            one.sendall(head.encode())  # and no body
        gives_up_at = time.monotonic() + 30.0
        while app.ask("POST", contract.RECOGNISE, b"\xc1")[0] != 503:
            assert time.monotonic() < gives_up_at
        assert app.ask("GET", contract.READY)[0] == 200
    finally:
        for one in waiting:
            one.close()
    while app.ask("POST", contract.RECOGNISE, b"\xc1")[0] == 503:
        assert time.monotonic() < gives_up_at
    assert app.ask("POST", contract.RECOGNISE, b"\xc1")[0] == 422


@on_uvicorn
def test_a_request_larger_than_any_is_refused_before_it_is_read(app):
    assert app.ask("POST", contract.RECOGNISE, bytes(64 << 20))[0] in (413, 422)
    assert app.health()["counts"]["refused: 413"] >= 1


@pytest.mark.parametrize(
    ("flags", "named"),
    [
        (["--replicas", "2"], "--engine ray"),
        (["--gpus", "1"], "--engine ray"),
        (["--engine", "uvicorn", "--write", "app.yaml"], "--write"),
        (["--host", "0.0.0.0"], TOKEN),
        (["--queue", "0"], "--queue"),
    ],
)
def test_an_option_that_cannot_be_followed_is_refused_with_its_cure(flags, named, monkeypatch):
    monkeypatch.delenv(TOKEN, raising=False)
    with socket.create_server(("127.0.0.1", 0)) as taken:  # where it would listen otherwise
        port = str(taken.getsockname()[1])
        done = hapticvlm("recogniser-app", *flags, "--port", port)
    assert done.code == 2
    assert named in done.err


async def settled_crops(app):
    """Return how many crops the app has recognised, once no late one is counted any more."""
    crops, before = app.health()["counts"].get("crops", 0), None
    while crops != before:
        await asyncio.sleep(2.0 * DEADLINE_S)
        crops, before = app.health()["counts"].get("crops", 0), crops
    return crops


async def until_here(client):
    """Look until this machine has to answer; return that answer."""
    started = time.monotonic()
    while is_shared(answer := await look(client)):
        assert time.monotonic() - started < BACK_S, "the fault was never noticed"
    return answer


async def touches_ms(client, count=100):
    """Touch, with a picture before every tenth, and return how long each answer took."""
    took = []
    for number in range(count):
        if number % 10 == 0:
            await look(client)
        started = time.perf_counter()
        await client.touch("slide" if number else "contact", "table")
        took.append((time.perf_counter() - started) * 1000.0)
        await asyncio.sleep(0.005)
    await client.touch("release")
    return took
