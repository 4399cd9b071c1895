"""What the service does as time passes, on a gateway without processes."""

import asyncio
import socket
import time
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from collecting import no_collection
from gateways import Peer, join, new_gateway
from pace import PACE

from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.speaker.ring import EngineStatus
from hapticvlm.messages import Set, Touch
from hapticvlm.server.counters import Count
from hapticvlm.server.supervision import Supervision
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

LOSSES_S = 10.0
TICK_S = 0.02

WITHIN_S = 5.0 * PACE  # on a busy machine
NOTHING_LOST = {"underruns": 0, "lost": 0, "scrubbed": 0, "newest": 0}


class Client:
    """A connection and what arrives at its other end."""

    def __init__(self, gateway, **role):
        self.peer = Peer()
        self.connection = join(gateway, peer=self.peer, **role)

    def received(self, kind):
        return [message for message in self.peer.sent if message["type"] == kind]


@pytest.fixture
def gateway():
    return new_gateway()


async def until(is_so, gateway, *running):
    """Run these, with every client reading, until it is so."""
    tasks = [asyncio.create_task(each) for each in running]
    try:
        async with asyncio.timeout(WITHIN_S):
            while not is_so():
                await asyncio.sleep(TICK_S / 4)
                for connection in gateway.connections:
                    connection._socket.read()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def touch(now):
    return Touch(
        id=9,
        phase="contact",
        object_id="table",
        hand="left",
        captured_at=now,
        speed_mps=0.1,
        force_n=1.0,
    )


async def test_a_lease_that_nobody_renews_is_ended_by_a_tick(gateway):
    owner = join(gateway)
    now = time.monotonic()
    gateway.carry_out(owner, owner.session.receive(touch(now), now))
    assert gateway.leases == 1
    begun_at, ordered = gateway.ownership.leased_at, gateway.outputs.speaker._ring.newest
    await until(lambda: gateway.leases == 0, gateway, Supervision(gateway).run())
    assert gateway.ownership.leased_at > begun_at, "the owner touched something until then"
    assert gateway.outputs.speaker._ring.newest > ordered, "the speaker was told"


async def test_a_fault_of_the_plate_is_reported_to_everybody_once_and_holds_it():
    gateway = new_gateway(SimulatedPlate(stuck_sensor_c=60.0))
    clients = [Client(gateway), Client(gateway), Client(gateway, observer=True)]
    supervisor = Supervision(gateway)
    await until(
        lambda: all(client.received("error") for client in clients),
        gateway,
        supervisor.run(),
    )
    for client in clients:
        (error,) = client.received("error")
        assert error["code"] == "device"
        assert "plate fault" in error["text"]
    assert gateway.outputs.reading.faults == ("over_temperature",)
    assert gateway.counts[Count.REFUSED_DEVICE] == 1
    assert gateway.outputs.hold.holds("peltier", None)
    assert not gateway.outputs.hold.holds("speaker", None)


async def test_telemetry_reaches_scenes_and_observers_and_counts_dropped_frames(gateway):
    clients = [Client(gateway), Client(gateway, observer=True)]
    gateway.counts.update(
        {Count.FRAMES_SUPERSEDED: 2, Count.FRAMES_RATE: 3, Count.REFUSED_TOKEN: 5}
    )
    begun = time.monotonic()
    await until(
        lambda: all(len(client.received("telemetry")) >= 2 for client in clients),
        gateway,
        Supervision(gateway).run(),
    )
    assert time.monotonic() - begun >= 0.1 - TICK_S
    state = clients[0].received("telemetry")[0]
    assert (state["id"], state["dropped_frames"], state["leases"]) == (0, 5, 0)
    assert state["faults"] == []


async def test_what_comes_during_a_tick_is_carried_out_before_the_loops_other_work(gateway):
    ours, theirs = socket.socketpair()
    order = []

    class Sees(Peer):
        def posted(self):
            order.append("telemetry")

    class Ticks(SceneSession):
        def tick(self, now, reading):
            order.append("tick")
            theirs.send(b"a message")
            return super().tick(now, reading)

    def take():
        ours.recv(64)
        order.append("message")

    client = join(gateway, peer=Sees())
    client.session = Ticks(SessionSettings(owner=True))
    loop = asyncio.get_running_loop()
    with ours, theirs:
        loop.add_reader(ours, take)
        await until(lambda: "telemetry" in order, gateway, Supervision(gateway).run())
        loop.remove_reader(ours)
    assert order[:3] == ["tick", "message", "telemetry"]


@pytest.mark.parametrize("is_connected", [True, False])
async def test_what_only_holds_itself_is_freed_before_python_would(gateway, is_connected):
    class Circle:
        def __init__(self):
            self.itself = self

    if is_connected:
        join(gateway)
    with no_collection():
        held = [weakref.ref(Circle()) for _ in range(1000)]
        await until(lambda: not any(each() for each in held), gateway, Supervision(gateway).run())


async def test_a_waveform_goes_to_those_that_watch_it(gateway):
    watching, other = (Client(gateway, observer=True) for _ in range(2))
    asked = watching.connection.session.receive(Set(id=2, watch=["waveform"]), 0.0)
    gateway.carry_out(watching.connection, asked)
    status = EngineStatus(
        beat_at=1.0, level=0.5, samples=480, realtime=False, has_output=True, **NOTHING_LOST
    )
    gateway.outputs.speaker._ring.report(status, np.full(480, 0.5, np.float32))
    await until(
        lambda: watching.received("view") and other.received("telemetry"),
        gateway,
        Supervision(gateway).run(),
    )
    (view,) = watching.received("view")[:1]
    assert view["kind"] == "waveform"
    assert set(view["samples"]) == {0.5}
    assert other.received("telemetry")
    assert other.received("view") == []


async def test_lines_missing_from_the_record_are_reported_and_not_again_at_once(gateway):
    scene = Client(gateway)
    gateway.recorder = SimpleNamespace(lost=3)
    supervisor = Supervision(gateway)
    for now, lost in ((0.0, 3), (1.0, 3), (2.0, 8), (LOSSES_S + 0.1, 9), (3 * LOSSES_S, 9)):
        gateway.recorder.lost = lost
        supervisor._report_losses(now)
    await until(lambda: len(scene.received("error")) >= 2, gateway)
    assert [(error["code"], error["text"].split(":")[0]) for error in scene.received("error")] == [
        ("overload", "the record misses 3 lines"),
        ("overload", "the record misses 9 lines"),
    ]
