"""Stop, and everything that ends a service: the vibration ends and the plate's bridge opens."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import peer, status
from pace import PACE
from scene_client import is_silent, owner_of, touching_client, until

from hapticvlm.client.local_service import Service, running
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.devices.plate.protocol import State
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard, SimulatedPort


async def cooled(client):
    """Touch something cold until the plate is driven far from neutral."""
    for _ in range(200):
        await client.touch("slide", "kettle", speed_mps=0.3)
        found = await client.telemetry()
        if found["plate_c"] is not None and found["plate_c"] < 27.0:
            return
    raise AssertionError("the plate never became cold")


@pytest.mark.parametrize("scope", ["all", "peltier"])
async def test_stop_opens_the_bridge_and_it_stays_open(service, scope):
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "kettle")
        await cooled(client)
        await client.ask(type="stop", scope=scope)
        await asyncio.sleep(0.2)  # a telemetry of the board, and one to us
        for _ in range(5):
            assert (await client.telemetry())["duty"] == 0.0  # 7.5 s of full heat before
            await client.touch("slide", "kettle")


async def test_a_lapse_keeps_the_gentle_way_to_neutral(service):
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "kettle")
        await cooled(client)
        for _ in range(100):  # telemetry each 0.1 s; the way back takes 4 s
            if (await client.telemetry())["duty"] > 0.5:
                return
        raise AssertionError("the plate was not warmed back to neutral")


def is_state(board, state):
    return board.plate.state is state


@pytest.mark.realtime
def test_the_bridge_opens_within_50_ms_of_stop_at_p99_while_the_plate_is_driven():
    board = SimulatedBoard()
    plate = Peltier("simulated", open_port=lambda _: SimulatedPort(board), simulated=True)
    plate.start()
    took: list[float] = []
    try:
        for _ in range(40):
            while not is_state(board, State.HOLDING):
                plate.command(20.0, 0.25, time.monotonic())
                time.sleep(0.01)
            stopped_at = time.monotonic()
            plate.off(stopped_at)
            plate.rest(stopped_at)  # as the session's next tick does
            while not is_state(board, State.OFF):
                time.sleep(0.001)
            took.append(time.monotonic() - stopped_at)
            time.sleep(0.05)
    finally:
        plate.close()
    assert np.percentile(took, 99) < 0.05 + 0.05  # and what a busy machine adds
    assert np.median(took) < 0.05


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no terminal to close")
def test_a_closed_terminal_ends_the_service_as_a_stop_does():
    # Whoever runs this under nohup hands on a SIGHUP that is ignored; a terminal does not.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    with running() as service:
        client = touching_client(service)
        service.process.send_signal(signal.SIGHUP)
        assert service.process.wait(60.0 * PACE) == 0
        client.wait(10.0 * PACE)
    assert any("outputs at rest" in line for line in service.printed)


def logging_into(descriptor):
    command = [sys.executable, "-m", "hapticvlm", "serve", "--port", "0"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=descriptor, text=True)


@pytest.mark.realtime
async def test_a_log_that_nobody_reads_holds_up_no_touch_and_no_stop():
    reading, writing = os.pipe()
    process = logging_into(writing)
    os.close(writing)
    try:
        line = ""
        while "ready on" not in line:
            line = await asyncio.to_thread(process.stdout.readline)
        service = Service(process, line.split("ready on ")[1].split()[0], 0.0)
        threading.Thread(target=process.stdout.read, daemon=True).start()
        async with peer(service) as client:
            await owner_of(client)
            longest = 0.0
            for _ in range(1200):  # 782 stops filled the pipe and hung the service before
                started = time.monotonic()
                await client.ask(type="stop", scope="speaker")
                longest = max(longest, time.monotonic() - started)
            assert longest < 1.0
        for _ in range(20):
            async with peer(service) as client:
                assert (await client.hello("observer"))["type"] == "welcome"
    finally:
        process.terminate()
        assert await asyncio.to_thread(process.wait, 10.0) == 0
        os.close(reading)
        process.stdout.close()


def files_of(pid):
    return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits another process's files")
async def test_a_child_that_dies_while_no_descriptor_is_left_ends_nobody_and_comes_back():
    import resource

    with running() as service:
        async with peer(service) as client:
            await owner_of(client)
            pid = service.process.pid
            before = status(service)["recogniser"]["pid"]
            limits = resource.prlimit(pid, resource.RLIMIT_NOFILE)
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (files_of(pid), limits[1]))
            os.kill(before, signal.SIGKILL)
            error = await client.event("error", code="model")
            while "could not be started" not in error["text"]:
                error = await client.event("error", code="model")
            assert (await client.touch("contact", "table"))["type"] == "ok"
            resource.prlimit(pid, resource.RLIMIT_NOFILE, limits)
            await until(
                service, lambda found: found["recogniser"]["pid"] not in (None, before), 60.0 * PACE
            )
            await client.touch("contact", "table")
            await until(service, lambda found: not is_silent(found))
