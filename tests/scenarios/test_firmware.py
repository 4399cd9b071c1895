"""The chaos table's rows of the plate, with the compiled firmware at the end of a serial line.

Times are the simulated chip's, which keeps to real time on a machine that is not too busy, until
its service is gone.
"""

import asyncio
import os
import signal
from collections.abc import Iterator

import pytest
from conftest import peer, status
from firmware import build
from firmware.board import RESET_EXTERNAL
from firmware_port import FirmwarePort, firmware_on_a_terminal
from scene_client import owner_of, until
from toolchains import require

from hapticvlm.client.local_service import running

pytestmark = pytest.mark.slow

OFF_S = 0.15  # from a stop: the service's turn of the line, the line, the chip's own
RETURN_S = 10.5  # to neutral, then off: at most this, by the firmware's own clock


@pytest.fixture(scope="module")
def chip():
    require("simavr", "make")
    return build.shared()


@pytest.fixture
def port(chip) -> Iterator[FirmwarePort]:
    board = chip.board()
    with firmware_on_a_terminal(board) as port:
        yield port
    board.close()


async def drive(client, port):
    """Touch something cold until the plate is driven."""
    driven = asyncio.create_task(asyncio.to_thread(port.until_driven))
    phase = "contact"
    while not driven.done():
        await client.touch(phase, "kettle")
        phase = "slide"
        await asyncio.sleep(0.05)
    await driven


async def test_a_stop_opens_the_bridge_at_once_and_a_lost_client_gently(port):
    with running(["--peltier", port.path]) as service:
        async with peer(service) as client:
            await owner_of(client)
            await drive(client, port)
            since = port.now
            await client.ask(type="stop", scope="all")
            assert await asyncio.to_thread(port.driven_for, since, 20.0) < OFF_S
            await client.touch("release")
            await drive(client, port)
            client.socket.transport.abort()
            since = port.now
        driven_s = await asyncio.to_thread(port.driven_for, since, 20.0)
        assert 2 * OFF_S < driven_s < RETURN_S


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
async def test_a_service_that_is_gone_leaves_the_board_to_return_to_neutral_and_off(port, number):
    with running(["--peltier", port.path]) as service:
        async with peer(service) as client:
            await owner_of(client)
            await drive(client, port)
            os.kill(service.process.pid, number)
            since, port.hurries = port.now, True
            client.socket.transport.abort()
        driven_s = await asyncio.to_thread(port.driven_for, since, 20.0)
        service.process.kill()
    assert driven_s < RETURN_S
    assert port.board.plant.plate_c > 26.0


async def test_a_service_that_ends_opens_the_bridge_at_once(port):
    with running(["--peltier", port.path]) as service:
        async with peer(service) as client:
            await owner_of(client)
            await drive(client, port)
            service.process.send_signal(signal.SIGTERM)
            since = port.now
            driven_s = await asyncio.to_thread(port.driven_for, since, 20.0)
    assert driven_s < 3 * OFF_S


async def test_a_board_that_resets_while_driving_stays_off_and_the_scene_is_told(port):
    with running(["--peltier", port.path]) as service:
        async with peer(service) as client:
            await owner_of(client)
            await drive(client, port)
            with port.lock:
                port.board.reset(RESET_EXTERNAL)
            since = port.now
            await client.event("error", code="device")
            assert await asyncio.to_thread(port.driven_for, since, 20.0) < OFF_S
            await until(service, lambda found: found["plate"]["faults"])
            await client.touch("contact", "kettle")
            await asyncio.sleep(0.5)
            assert not port.is_driven
            assert status(service)["plate"]["faults"]
