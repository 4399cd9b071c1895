"""What the service does as time passes, on a gateway without processes."""

import asyncio
import socket
import time
import weakref
from collections import Counter
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import pytest
from collecting import no_collection
from gateways import Peer, join, look, new_gateway
from pace import PACE
from timeless import TimelessLoop

from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.messages import Touch
from hapticvlm.server import supervision
from hapticvlm.server.counters import Count
from hapticvlm.server.supervision import Supervision
from hapticvlm.server.vlm_queue import VlmQueue
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.vision.remote.settings import RemoteState
from hapticvlm.vlm.contract import VlmSettings
from hapticvlm.vlm.worker import VlmWorker

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


@pytest.fixture
def clock(monkeypatch):
    at = SimpleNamespace(now=time.monotonic())
    monkeypatch.setattr(supervision, "time", SimpleNamespace(monotonic=lambda: at.now))
    return at


class Supervised:
    """A gateway with a vision-language model that is checked once; an owner and an observer."""

    def __init__(self):
        self.gateway = new_gateway()
        counts, deliver = self.gateway.counts, self.gateway.deliver
        self.gateway.vlm = self.vlm = VlmQueue(VlmWorker(VlmSettings()), counts, deliver)
        self.clients = [Client(self.gateway), Client(self.gateway, observer=True)]
        self._supervision = Supervision(self.gateway)

    def told(self):
        """What each check tells everybody: the codes and texts of its errors."""
        self._supervision._supervise()
        for client in self.clients:
            client.peer.read()
        one, other = ([(e["code"], e["text"]) for e in c.received("error")] for c in self.clients)
        for client in self.clients:
            client.peer.sent.clear()
        assert one == other
        assert self.gateway.counts.total() == len(one)
        self.gateway.counts.clear()
        return one


@pytest.mark.parametrize(
    ("child", "check", "code"),
    [
        ("outputs.speaker", "supervise", "device"),
        ("outputs.speaker", "watch_state", "device"),
        ("recogniser.worker", "supervise", "model"),
        ("vlm.worker", "supervise", "model"),
    ],
)
def test_what_befalls_a_child_is_told_to_everybody_in_its_words(child, check, code, monkeypatch):
    supervised = Supervised()
    assert supervised.told() == []
    monkeypatch.setattr(attrgetter(child)(supervised.gateway), check, lambda *_: "it died")
    gateway, owner = supervised.gateway, supervised.clients[0].connection
    gateway.carry_out(owner, owner.session.receive(touch(time.monotonic()), time.monotonic()))
    assert supervised.told() == [(code, "it died")]
    assert gateway.leases == (0 if (child, check) == ("outputs.speaker", "supervise") else 1)


def test_what_is_worn_and_faulty_is_named_once_until_it_is_well():
    supervised = Supervised()
    glove: Any = SimpleNamespace(name="left glove", faults=["plate_silent"])
    supervised.gateway.outputs.worn = [glove]
    ((code, text),) = supervised.told()
    assert (code, text.partition(": ")[0]) == ("device", "left glove")
    assert supervised.told() == []
    glove.faults = []
    assert supervised.told() == []
    glove.faults = ["plate_silent"]
    assert len(supervised.told()) == 1


def test_a_helper_that_fails_is_told_to_everybody_and_one_that_answers_again_to_the_log(
    clock, caplog
):
    supervised = Supervised()
    asked: dict[str, Any] = {"identity": "", "answered": 0, "failed": 1, "local": 1}
    untried, away, used = (
        RemoteState(is_used=is_used, reason=reason, **asked)
        for is_used, reason in ((False, ""), (False, "it is away"), (True, ""))
    )
    told = []
    for shared in (untried, away, used, away):
        clock.now += 60.1
        supervised.gateway.recogniser.remote = shared
        told.append([text for _, text in supervised.told()])
    words = "the shared recogniser fails: it is away; pictures are recognised here"
    assert told == [[], [words], [], [words]]
    news = supervised.vlm.news
    news.note("the model", "no memory", clock.now)
    assert supervised.told() == [("model", "the model fails: no memory")]
    caplog.clear()
    news.note("the model", None, clock.now + 60.1)
    assert supervised.told() == []
    assert caplog.messages == ["the model answers again"]


def test_a_frame_that_waits_for_a_recogniser_that_stays_away_is_answered_by_a_check(clock):
    supervised = Supervised()
    (owner, _) = supervised.gateway.connections
    supervised.gateway.recognition.put(owner, look("cup"))
    for waited_s, answers in ((0.0, 0), (4.9, 0), (0.2, 1)):
        clock.now += waited_s
        supervised._supervision._supervise()
        supervised.clients[0].peer.read()
        assert len(supervised.clients[0].received("error")) == answers


@pytest.mark.parametrize(
    ("is_connected", "rates_hz"),
    [(True, {"wakes": 50, "checks": 10, "telemetry": 10}), (False, {"wakes": 10, "telemetry": 10})],
)
def test_the_loops_own_work_has_its_rates(is_connected, rates_hz, monkeypatch):
    loop = TimelessLoop()
    monkeypatch.setattr(supervision, "time", SimpleNamespace(monotonic=loop.time))
    gateway, done = new_gateway(), Counter[str]()
    outputs: Any = gateway.outputs
    if is_connected:
        join(gateway)

    def count(name, part, method):
        carry_out = getattr(part, method)

        def note(*given):
            done[name] += 1
            return carry_out(*given)

        monkeypatch.setattr(part, method, note)

    count("wakes", outputs, "follow")
    count("checks", outputs.speaker, "supervise")
    count("telemetry", outputs.speaker, "loudest")

    async def ten_seconds():
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(Supervision(gateway).run(), 10.0)

    loop.run_until_complete(ten_seconds())
    loop.close()
    assert {name: done[name] / 10 for name in rates_hz} == pytest.approx(rates_hz, rel=0.2)
