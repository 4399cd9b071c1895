"""The chaos table's rows of the plate, with the compiled firmware at the end of a serial line.

Times are the simulated chip's, which keeps to real time on a machine that is not too busy, until
its service is gone.
"""

import asyncio
import os
import random
import signal
from collections.abc import Iterator

import pytest
from conftest import peer, status
from firmware import build
from firmware.board import RESET_EXTERNAL
from firmware_port import FirmwarePort, firmware_on_a_terminal, is_away
from scene_client import owner_of, until
from toolchains import require

from hapticvlm.client.local_service import running

pytestmark = pytest.mark.slow

OFF_S = 0.15  # from a stop: the service's turn of the line, the line, the chip's own
RETURN_S = 10.5  # to neutral, then off: at most this, by the firmware's own clock
END = {"killed": signal.SIGKILL, "frozen": signal.SIGSTOP}


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


async def slide(client, thing, is_over, phase="slide"):
    """Touch without end, as a client does that knows nothing of what happened."""
    while not is_over():
        await client.touch(phase, thing)
        phase = "slide"
        await asyncio.sleep(0.05)


async def drive(client, port, *, warm=False):
    """Touch something cold or warm until the plate is driven."""
    thing = "mug" if warm else "kettle"
    mug = {"object_id": "mug", "material": "metal", "temperature_c": 55.0}
    await client.ask(type="scene", objects=[mug], replace=False)
    driven = asyncio.create_task(asyncio.to_thread(port.until_driven, warm=warm))
    while not driven.done():
        over = port.now + 6.0
        await slide(client, thing, lambda over=over: driven.done() or port.now > over, "contact")
        if not driven.done():  # after a fault nothing resumes by itself: touch again
            await client.touch("release")
            await asyncio.sleep(1.0)
    await driven
    return thing


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


async def end_and_return(port, end, *, warm=False, later_s=0.0):
    """Drive the plate, end its service or the line, and see it return to neutral and off."""
    port.is_cut = port.hurries = False
    with running(["--peltier", port.path]) as service:
        async with peer(service) as client:
            await owner_of(client)
            thing = await drive(client, port, warm=warm)
            moment = port.now + later_s
            await slide(client, thing, lambda: port.now > moment)
            if end == "line cut":
                port.is_cut = True
            else:
                os.kill(service.process.pid, END[end])
            since, port.hurries = port.now, True
            gone = asyncio.create_task(asyncio.to_thread(port.driven_for, since, 20.0))
            if port.is_cut:  # the scene goes on, and so does its service
                await slide(client, thing, gone.done)
            assert await gone < RETURN_S
            assert not is_away(port.board.plant.plate_c, warm=warm)
            if port.is_cut:
                port.is_cut = port.hurries = False
                await drive(client, port, warm=warm)
            service.process.kill()
            client.socket.transport.abort()


@pytest.mark.parametrize("end", END)
async def test_a_service_that_is_gone_leaves_the_board_to_return_to_neutral_and_off(port, end):
    await end_and_return(port, end)


@pytest.mark.nightly
async def test_whenever_service_or_line_goes_the_plate_returns_and_is_driven_again(port):
    draw = random.Random(59)
    for number in range(20):
        end = (*END, "line cut")[number % 3]
        await end_and_return(port, end, warm=draw.random() < 0.5, later_s=draw.uniform(0.0, 1.5))


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
