"""The loop's own work goes between touches, on a loop whose time only passes while it waits."""

import asyncio
from typing import cast

import msgpack
import numpy as np
import pytest
from gateways import Peer, join, new_gateway
from timeless import TimelessLoop

from hapticvlm.server.edge.scheduling import IdleScheduler
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.websocket import MessageHandler

TICK_S = 0.02

WORK_S = 0.0005  # more than a tick takes


@pytest.fixture
def loop():
    made = TimelessLoop()
    yield made
    made.close()


async def worked_at(scheduler, touches, until):
    """Touch at these times; return when there was work."""
    loop = asyncio.get_running_loop()
    for at in touches:
        loop.call_at(at, scheduler.touched)
    found = []
    while loop.time() < until:
        await scheduler.wait(TICK_S)
        found.append(loop.time())
    return np.array(found)


def hands(rate, seconds, *, apart, jitter):
    """Return when both hands touch, so many times a second, and unevenly."""
    frames = np.arange(1, seconds * rate) / rate
    frames += np.random.default_rng(int(rate)).uniform(-jitter, jitter, frames.size)
    return np.sort(np.concatenate([frames, frames + apart]))


@pytest.mark.parametrize("rate", [72, 80, 90, 100, 120, 144])
def test_no_touch_of_a_headset_meets_the_loops_own_work(loop, rate):
    touches = hands(rate, 20, apart=0.0003, jitter=0.0005)
    work = loop.run_until_complete(worked_at(IdleScheduler(), touches, 20.0))
    follows = np.searchsorted(work, touches) - 1  # the work before each touch
    late = touches - work[np.maximum(follows, 0)] < WORK_S
    assert not late[follows >= 0].any()
    assert np.diff(work).max() <= TICK_S + 1e-9, "never later than without touches"
    assert np.diff(work).min() >= 0.005, "and not at every touch of a flood"


def test_without_touches_work_is_done_when_it_is_due(loop):
    work = loop.run_until_complete(worked_at(IdleScheduler(), [], 1.0))
    assert np.allclose(np.diff(work), TICK_S)


def test_a_flood_of_touches_puts_work_off_by_nothing(loop):
    flood = np.arange(0.0, 2.0, 0.0003)
    work = loop.run_until_complete(worked_at(IdleScheduler(), flood, 2.0))
    assert np.diff(work).max() <= TICK_S + 1e-9
    assert work.size < 2.0 / 0.005


def test_a_touch_that_was_answered_lets_work_begin_and_other_messages_do_not(loop):
    gateway, peer = new_gateway(), Peer()
    owner = join(gateway, peer=peer)
    talk = MessageHandler(cast("ClientSocket", peer), owner, gateway, loop.time)
    hand = {"hand": "left", "object_id": "table", "speed_mps": 0.1, "force_n": 1.0}
    touch = {"type": "touch", "id": 7, "phase": "contact", "captured_at": 0.0, **hand}
    for said, after in (({"type": "set", "id": 8}, 0.02), (touch, 0.011)):
        begun = loop.time()
        loop.call_at(begun + 0.01, talk.receive, msgpack.packb(said))
        loop.run_until_complete(gateway.scheduler.wait(TICK_S))
        assert loop.time() - begun == pytest.approx(after)
    assert [answer["type"] for answer in peer.sent[:2]] == ["ok", "ok"]
