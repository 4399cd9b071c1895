"""The gateway and its queues without a socket: who owns the outputs, and whose picture is next."""

import asyncio
import socket
import time
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from gateways import Peer, join, look, new_gateway
from msgspec import structs

from hapticvlm.devices.plate.protocol import State as PlateState
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import (
    Error,
    MessageError,
    Ownership,
    Scene,
    SceneObject,
    Set,
    Skipped,
    Touch,
)
from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.server import recognition_queue
from hapticvlm.server.connection import Connection
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.scheduling import yield_to_io
from hapticvlm.server.outputs import Outputs
from hapticvlm.server.recognition_queue import RecognitionQueue
from hapticvlm.session.actions import DrivePlate, RestPlate
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import (
    HandRegion,
    RequestId,
    Surroundings,
    TextureTarget,
)
from hapticvlm.vision.pictures import Thumbnail
from hapticvlm.vision.recognition import Recognition
from hapticvlm.vision.worker import RecogniserResult, RecogniserWorker

IDLE_OWNER_S = 30.0

PEER: Any = Peer()


@pytest.fixture
def gateway():
    return new_gateway()


def asking(ownership):
    return Set(id=5, ownership=ownership)


def touch(**fields):
    given = {"id": 9, "phase": "contact", "object_id": "a", "hand": "left", "captured_at": 0.0}
    return Touch(**{**given, "speed_mps": 0.1, "force_n": 1.0, **fields})


def test_the_first_scene_owns_the_outputs_and_a_later_one_may_not_touch(gateway):
    first, second = join(gateway), join(gateway)
    assert gateway.owner is first
    with pytest.raises(MessageError, match="owns"):
        second.session.receive(touch(), 0.0)


def test_an_owner_that_touched_something_lately_keeps_the_outputs(gateway):
    first, second = join(gateway), join(gateway)
    now = gateway.ownership.leased_at + IDLE_OWNER_S - 0.1
    text = r"owns the outputs and touched something 30 s ago: wait until 30 s have passed"
    with pytest.raises(MessageError, match=text) as refused:
        gateway.ownership.change(second, asking("take"), now)
    assert (refused.value.code, refused.value.path) == ("not_owner", "$.ownership")
    assert refused.value.id == 5
    assert gateway.owner is first
    assert first.session.owner
    assert not second.session.owner


def test_who_joins_does_not_make_an_idle_owner_a_busy_one(gateway):
    join(gateway)
    gateway.ownership.leased_at -= IDLE_OWNER_S + 0.001
    second = join(gateway)
    join(gateway, observer=True)
    gateway.ownership.change(second, asking("take"), time.monotonic())
    assert gateway.owner is second


def test_an_idle_owner_gives_the_outputs_to_the_scene_that_asks(gateway):
    first, second = join(gateway), join(gateway)
    now = gateway.ownership.leased_at + IDLE_OWNER_S + 0.001  # a sum is rounded
    first.session.receive(touch(), now)
    gateway.ownership.change(second, asking("take"), now)
    assert gateway.owner is second
    assert first.session.leases == 0
    (told,) = [each.message for each in first._waiting if isinstance(each.message, Error)]
    assert (told.id, told.code, told.text) == (
        0,
        "not_owner",
        "another scene took the outputs: nothing was touched for 30 s",
    )
    assert not first.session.owner
    with pytest.raises(MessageError):
        first.session.receive(touch(), now)
    assert second.session.receive(touch(), now)
    assert gateway.counts["owners replaced"] == 1


def test_who_lost_the_outputs_feels_nothing_of_what_the_new_owner_does(gateway):
    first, second = join(gateway), join(gateway)
    gateway.vibration.is_on = True  # as after a `set.feel`; its planners need an event loop
    gateway.vibration._post = first.post
    now = gateway.ownership.leased_at + IDLE_OWNER_S + 0.001
    gateway.ownership.change(second, asking("take"), now)
    assert not gateway.vibration.is_on
    assert gateway.vibration._post is None


def test_only_an_observer_of_this_machine_states_materials(gateway):
    owner = join(gateway)
    remote = join(gateway, observer=True, peer=Peer(address="192.0.2.7"))
    stated = Scene(id=7, objects=[SceneObject(object_id="a", material="metal")], replace=False)
    owner.session.receive(
        Scene(id=1, objects=[SceneObject(object_id="a", name="thing")], replace=True), 0.0
    )
    with pytest.raises(MessageError, match="own machine") as refused:
        gateway.override_materials(remote, stated, 0.0)
    assert (refused.value.code, refused.value.id) == ("protocol", 7)
    assert not owner.session.overrides.stated
    gateway.override_materials(join(gateway, observer=True), stated, 0.0)
    assert owner.session.overrides.stated == {"a": SceneObject(object_id="a", material="metal")}


def test_an_observer_never_takes_the_outputs(gateway):
    join(gateway)
    observer = join(gateway, observer=True)
    with pytest.raises(MessageError, match="connect as scene"):
        gateway.ownership.change(
            observer, asking("take"), gateway.ownership.leased_at + 10 * IDLE_OWNER_S
        )


def test_a_scene_takes_outputs_that_nobody_owns(gateway):
    first, second = join(gateway), join(gateway)
    gateway.leave(first)
    assert gateway.owner is None
    gateway.ownership.change(second, asking("take"), gateway.ownership.leased_at)
    assert gateway.owner is second


def ownership_notes(connection):
    """What a connection was notified of, as (owner, free)."""
    notes = [event.message for event in connection._waiting]
    assert all(note.id == 0 for note in notes)
    return [(note.owner, note.free) for note in notes if isinstance(note, Ownership)]


def test_free_outputs_are_offered_to_every_scene_and_go_to_the_first_that_asks(gateway):
    first, second, third = join(gateway), join(gateway), join(gateway)
    observer = join(gateway, observer=True)
    gateway.leave(first)
    assert [ownership_notes(each) for each in (second, third)] == [[(False, True)]] * 2
    assert ownership_notes(observer) == []
    gateway.ownership.change(second, asking("take"), gateway.ownership.leased_at)
    assert ownership_notes(second) == [(False, True)]  # the take itself is answered
    assert ownership_notes(third) == [(False, True), (False, False)]
    with pytest.raises(MessageError, match="owns the outputs"):
        gateway.ownership.change(third, asking("take"), gateway.ownership.leased_at)


def test_a_scene_that_waits_is_told_that_a_newcomer_owns_the_free_outputs(gateway):
    first, second = join(gateway), join(gateway)
    gateway.leave(first)
    newcomer = join(gateway)
    assert ownership_notes(second) == [(False, True), (False, False)]
    assert ownership_notes(newcomer) == []


def test_an_owner_that_gives_the_outputs_up_stays_and_may_take_them_again(gateway):
    first, second = join(gateway), join(gateway)
    now = gateway.ownership.leased_at
    gateway.ownership.change(second, asking("give"), now)  # they are not its own: nothing changes
    assert gateway.owner is first
    first.session.receive(touch(), now)
    gateway.ownership.change(first, asking("give"), now)
    assert gateway.owner is None
    assert first.session.leases == 0
    assert ownership_notes(second) == [(False, True)]
    with pytest.raises(MessageError, match="owns"):
        first.session.receive(touch(), now)
    gateway.ownership.change(first, asking("take"), now)
    assert gateway.owner is first


def test_an_observer_ends_an_owner_at_once_and_the_outputs_rest(gateway):
    peer = Peer()
    join(gateway, peer=peer)
    observer = join(gateway, observer=True)
    before = gateway.outputs.speaker._ring.newest
    gateway.ownership.change(observer, asking("end"), 0.0)
    assert peer.closed is not None
    assert peer.closed[1] == "ended by an observer"
    assert gateway.outputs.speaker._ring.newest == before + 1  # the order to rest
    assert gateway.counts["owners ended"] == 1


def test_nobody_can_be_ended_when_nobody_owns(gateway):
    observer = join(gateway, observer=True)
    with pytest.raises(MessageError, match="nobody owns"):
        gateway.ownership.change(observer, asking("end"), 0.0)


def test_a_gain_that_was_set_is_that_of_the_next_owner(gateway):
    first = join(gateway)
    gateway.carry_out(first, first.session.receive(Set(id=3, vibration_gain=0.2), 0.0))
    gateway.vibration.is_on = True  # as after `set feel`
    gateway.leave(first)
    assert not gateway.vibration.is_on  # its plans are nobody else's
    join(gateway)
    assert gateway.outputs.speaker._settings.gain == 0.2


def test_a_thermal_gain_that_was_set_is_that_of_the_next_owner_too(gateway):
    first, second = join(gateway), join(gateway)
    gateway.carry_out(first, first.session.receive(Set(id=3, thermal_gain=0.2), 0.0))
    assert gateway.outputs.thermal_gain == 0.2
    gateway.leave(first)
    gateway.ownership.change(second, asking("take"), 0.0)
    assert second.session._touches.plate.gain == 0.2


@pytest.mark.parametrize("rest", [Outputs.rest, lambda outputs: outputs.drive(RestPlate())])
def test_a_plate_at_rest_returns_to_neutral_long_before_its_lease_ends(rest):
    plate = SimulatedPlate()
    outputs = new_gateway(plate).outputs
    outputs.drive(DrivePlate(setpoint_c=20.0, ttl_s=60.0))
    states = [plate.state]
    rest(outputs)
    assert [*states, plate.state] == [PlateState.HOLDING, PlateState.RETURNING]


class Idle:
    """A recogniser that is handed frames and never answers."""

    def __init__(self):
        self.subjects: list[str] = []
        self.worker = SimpleNamespace(is_busy=True)
        self.asked: dict[str, Any] = {}
        self.remote: Any = None

    def recognise(self, _frame, subject, _now, **asked):
        self.subjects.append(subject)
        self.asked = asked

    def note(self, remote):
        self.remote = remote


def scene(name, *, owner=False):
    session = SceneSession(SessionSettings(owner=owner))
    return Connection(PEER, name, session, as_text=False)


def test_the_owners_pictures_come_first_and_the_others_take_turns():
    recogniser = Idle()
    queue = RecognitionQueue(recogniser, Counter(), lambda *_: None)  # type: ignore[arg-type]
    guest, other, owner = scene("guest"), scene("other"), scene("owner", owner=True)
    for client in (guest, other, owner):
        queue.join(client)
    for _ in range(2):
        for client in (guest, other, owner):
            queue.put(client, look("x"))
        recogniser.worker.is_busy = False
        queue.feed()
        queue.feed()
        queue.feed()
        recogniser.worker.is_busy = True
        for _ in range(2):
            queue.put(guest, look("x"))
            queue.put(other, look("x"))
            recogniser.worker.is_busy = False
            queue.feed()
            recogniser.worker.is_busy = True
    names = [subject.split("/")[0] for subject in recogniser.subjects]
    assert names == ["owner", "guest", "other", "guest", "other"] * 2


def test_a_frame_is_answered_when_the_recogniser_does_not_come_back():
    gateway = new_gateway()  # its recogniser was never started
    peer = Peer()
    queue, client = gateway.recognition, join(gateway, peer=peer)
    kinds = [
        look("x", id=2),
        look("x", "enrol", id=3),
        replace(texture("x"), reply_to=RequestId(4)),
        replace(look("x", id=5), target=HandRegion("left")),
        replace(look("x", id=6), target=Surroundings()),
    ]
    for request in kinds:
        queue.put(client, request)
    queue.answer_without(100.0)
    queue.answer_without(104.9)
    peer.read()
    assert peer.sent == []
    queue.answer_without(105.1)
    queue.answer_without(106.0)
    peer.read()
    answers = sorted((each["id"], each["code"]) for each in peer.sent)
    assert answers == [(number, "model") for number in (2, 3, 4, 5, 6)]


class Looks:
    """A queue before a recogniser that is idle, with an owner that looks at things."""

    def __init__(self):
        self.recogniser, self.counts = Idle(), Counter[Count]()
        self.recogniser.worker = SimpleNamespace(is_busy=False, accept=lambda *_: True)
        self.delivered: list[Any] = []
        self.queue = RecognitionQueue(
            cast("RecogniserWorker", self.recogniser),
            self.counts,
            lambda _, actions: self.delivered.extend(actions),
        )
        self.peer = Peer()
        self.owner = join(new_gateway(), peer=self.peer)
        self.queue.join(self.owner)

    async def answer(self, result):
        self.queue.accept(WorkerReply(1, result))
        for _ in range(2):
            await yield_to_io()


async def test_live_frames_and_those_to_enrol_take_turns():
    looks = Looks()
    for request in (look("a", "enrol"), look("b", "enrol"), look("x")):
        looks.queue.put(looks.owner, request)
    for _ in range(4):
        looks.queue.feed()
        looks.queue.put(looks.owner, look("x"))
    things = [subject.rpartition(" ")[2] for subject in looks.recogniser.subjects]
    assert things == ["x", "a", "x", "b"]


async def test_the_frame_under_way_is_answered_once_when_the_recogniser_is_restarted():
    looks = Looks()
    looks.queue.put(looks.owner, look("x", id=2))
    looks.queue.feed()
    for _ in range(2):
        looks.queue.fail("it was restarted")
    looks.peer.read()
    assert [(each["id"], each["code"]) for each in looks.peer.sent] == [(2, "model")]
    looks.recogniser.worker.accept = lambda *_: False
    await looks.answer(RecogniserResult(Recognition(None, {})))
    assert (looks.counts, looks.delivered) == ({Count.LATE_ANSWERS: 1}, [])


@pytest.mark.parametrize("reply_to", [RequestId(2), None])
async def test_a_frame_that_is_not_recognised_is_counted_and_answered_with_why_if_somebody_waits(
    reply_to, monkeypatch
):
    looks, request = Looks(), replace(look("x", id=2), reply_to=reply_to)
    monkeypatch.setattr(looks.owner.session, "is_stale", lambda *_: True)
    said = [*looks.queue.put(looks.owner, request), *looks.queue.put(looks.owner, request)]
    assert looks.counts == {Count.FRAMES_SUPERSEDED: 1}
    looks.queue.feed()
    looks.peer.read()
    assert looks.counts == {Count.FRAMES_SUPERSEDED: 1, Count.FRAMES_STALE: 1}
    told = [(each.id, each.reason) for each in said if isinstance(each, Skipped)]
    told += [(each["id"], each["reason"]) for each in looks.peer.sent]
    assert told == ([(2, "superseded"), (2, "stale")] if reply_to else [])
    assert looks.recogniser.subjects == []


@pytest.mark.parametrize(
    ("error", "told", "count"),
    [
        ({}, ("message", "$.image"), Count.REFUSED_MESSAGE),
        ({"error_path": "$.mask"}, ("message", "$.mask"), Count.REFUSED_MESSAGE),
        ({"is_our_fault": True}, ("model", "$.image"), Count.REFUSED_MODEL),
    ],
)
@pytest.mark.parametrize("reply_to", [RequestId(2), None])
async def test_a_picture_that_cannot_be_recognised_is_refused_with_its_field_and_counted(
    error, told, count, reply_to
):
    looks = Looks()
    looks.queue.put(looks.owner, replace(look("x", id=2), reply_to=reply_to))
    looks.queue.feed()
    await looks.answer(RecogniserResult(Recognition(None, {}, error="no picture", **error)))
    answers = [each.message for each in looks.delivered]
    wanted = [(2, *told, "no picture")] if reply_to else []
    assert [(each.id, each.code, each.path, each.text) for each in answers] == wanted
    assert looks.counts == {count: 1}


def texture(name):
    request = look(name, "texture")
    return replace(request, target=TextureTarget(name))


def test_texture_maps_wait_until_no_frame_of_any_connection_is_due():
    recogniser = Idle()
    queue = RecognitionQueue(recogniser, Counter(), lambda *_: None)  # type: ignore[arg-type]
    guest, owner = scene("guest"), scene("owner", owner=True)
    for client in (guest, owner):
        queue.join(client)
    for request in (texture("planks"), texture("bricks"), look("a", "enrol"), look("x")):
        queue.put(owner, request)
    queue.put(guest, look("y"))
    recogniser.worker.is_busy = False
    for _ in range(6):
        queue.feed()
    assert recogniser.subjects == [
        "owner/object x",
        "owner/object a",
        "guest/object y",
        "owner/texture planks",
        "owner/texture bricks",
    ]


@pytest.mark.parametrize(
    ("kind", "most"), [(lambda _: look("same", "enrol"), 8), (lambda name: texture(name), 16)]
)
def test_too_many_of_one_kind_that_wait_are_refused_and_counted(kind, most):
    looks = Looks()
    looks.recogniser.worker.is_busy = True
    assert all(looks.queue.put(looks.owner, kind(str(number))) == [] for number in range(most))
    (refused,) = looks.queue.put(looks.owner, kind("one more"))
    assert isinstance(refused, Error)
    assert (refused.code, refused.path) == ("overload", "$.purpose")
    assert looks.queue.put(looks.owner, replace(kind("unasked"), reply_to=None)) == []
    assert looks.counts == {Count.REFUSED_OVERLOAD: 2}
    assert looks.queue.put(looks.owner, look("another", "enrol")) == []


SHOWN_BYTES = 256 * 1024


@pytest.mark.parametrize(
    ("change", "is_small"),
    [
        ({}, True),
        ({"format": "png", "width": 640, "height": 640}, True),
        ({"width": 641}, False),
        ({"height": 641}, False),
        ({"image": bytes(SHOWN_BYTES - 1), "mask": b"m"}, True),
        ({"image": bytes(SHOWN_BYTES), "mask": b"m"}, False),
        ({"format": "rgb8"}, False),
    ],
)
async def test_observers_are_shown_a_small_picture_as_it_came_and_a_thumbnail_of_another(
    change, is_small
):
    looks, observer, state = Looks(), scene("observer"), cast("Any", object())
    observer.watches = frozenset({"frames"})
    looks.queue.join(observer)
    given: dict[str, Any] = {"format": "jpeg", "image": b"j", "mask": None, "origin": "bottom"}
    request = look("cup")
    picture = structs.replace(request.picture, **{**given, **change})
    looks.queue.put(looks.owner, replace(request, picture=picture))
    looks.queue.feed()
    assert looks.recogniser.asked["shrink"] != is_small
    thumbnail = None if is_small else Thumbnail(b"small", b"outline")
    await looks.answer(RecogniserResult(Recognition(None, {}), thumbnail, state))
    assert looks.recogniser.remote is state
    assert looks.counts == {Count.RECOGNITIONS: 1}
    view: Any = observer._waiting[0].message
    as_it_came = (picture.format, picture.image, picture.mask, "bottom")
    shown = as_it_came if is_small else ("jpeg", b"small", b"outline", "top")
    assert (view.format, view.image, view.mask, view.origin) == shown
    assert (view.kind, view.object_id) == ("frames", "cup")


async def looking(log):
    """Hand over a frame of an owner; `log` says when its answer is given."""
    recogniser = Idle()
    recogniser.worker.accept = lambda *_: True
    queue = RecognitionQueue(recogniser, Counter(), lambda *_: log.append("answered"))  # type: ignore[arg-type]
    client = scene("owner", owner=True)
    queue.join(client)
    recogniser.worker.is_busy = False
    queue.put(client, look("first"))
    await yield_to_io()
    return queue, client, recogniser


async def test_an_answer_and_the_frame_after_it_have_a_turn_each_between_which_a_touch_may_go():
    log: list[str | bytes] = []
    queue, client, recogniser = await looking(log)
    recogniser.worker.is_busy = True
    queue.put(client, look("second"))
    recogniser.worker.is_busy = False
    ours, theirs = socket.socketpair()
    with ours, theirs:
        # A touch comes while the answer is taken, and another while it is given.
        asyncio.get_running_loop().add_reader(ours, lambda: log.append(ours.recv(9)))
        queue.accept(WorkerReply(1, RecogniserResult(Recognition(None, {}))))
        theirs.send(b"touch")
        assert log == []
        while len(recogniser.subjects) == 1:
            if log and log[-1] == "answered":
                theirs.send(b"another")
            log.append("turn")
            await asyncio.sleep(0)
        asyncio.get_running_loop().remove_reader(ours)
    log = [entry for entry in log if entry != "turn"]
    assert log == [b"touch", "answered", b"another"], "and then the next frame"


async def test_who_left_before_its_answer_was_given_gets_none():
    log: list[str | bytes] = []
    queue, client, _ = await looking(log)
    queue.accept(WorkerReply(1, RecogniserResult(Recognition(None, {}))))
    queue.leave(client)
    await yield_to_io()
    assert log == []


async def test_what_was_never_seen_waits_for_no_turn_however_much_was_looked_at():
    recogniser = Idle()
    queue = RecognitionQueue(recogniser, Counter(), lambda *_: None)  # type: ignore[arg-type]
    client = scene("owner", owner=True)
    queue.join(client)
    wood = Evidence("encoder", (("wood", 0.9),))
    client.session.recognised(look("thing"), wood, {}, time.monotonic())
    recogniser.worker.is_busy = False
    for _ in range(40):
        queue.put(client, look("thing"))
        await yield_to_io()
    assert len(recogniser.subjects) < 40, "looks at it wait for their turn"
    queue.put(client, look("new"))
    await yield_to_io()
    assert recogniser.subjects[-1] == "owner/object new"


async def test_observers_are_shown_a_frame_of_an_object_twice_a_second(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(recognition_queue, "time", SimpleNamespace(monotonic=lambda: clock.now))
    queue, client, recogniser = await looking([])
    observer = scene("observer")
    observer.watches = frozenset({"frames"})
    queue.join(observer)
    reply = WorkerReply(1, RecogniserResult(Recognition(None, {}), Thumbnail(b"", None)))
    queue.accept(reply)  # to the frame handed over before anybody watched

    async def show(name):
        queue.put(client, look(name))
        await yield_to_io()
        queue.accept(reply)
        await yield_to_io()

    for number in range(24):
        clock.now = 100.0 + number / 8
        await show("thing")
    assert len(recogniser.subjects) == 25
    assert len(observer._waiting) == 6, "of three seconds"
    for number in range(255):
        await show(f"thing {number}")
    assert len(queue._shown_at) == 256
    await show("one too many")
    assert len(queue._shown_at) == 1, "all were forgotten"


def test_what_waits_to_be_enrolled_has_one_budget_for_all_connections():
    counts: Counter[str] = Counter()
    queue = RecognitionQueue(Idle(), counts, lambda *_: None)  # type: ignore[arg-type]
    clients = [scene(str(number)) for number in range(3)]
    for client in clients:
        queue.join(client)
    half = 16 * 1024 * 1024
    assert queue.put(clients[0], look("a", "enrol", half)) == []
    assert queue.put(clients[1], look("b", "enrol", half)) == []
    (refused,) = queue.put(clients[2], look("c", "enrol", 1))
    assert isinstance(refused, Error)
    assert (refused.code, refused.path) == ("overload", "$.purpose")
    assert refused.text == "too many enrol frames wait: send more when some of these are decided"
    queue.leave(clients[0])
    maps = replace(look("c", "texture", half), target=TextureTarget("c"))
    assert queue.put(clients[2], maps) == []
    assert isinstance(queue.put(clients[2], look("c", "enrol", 1))[0], Error)
    assert queue._mailboxes[clients[2]].take_texture() is maps
    assert queue.put(clients[2], look("c", "enrol", half)) == []
