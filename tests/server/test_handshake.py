"""Hello and welcome without a network: who is admitted, who is refused, and what is promised."""

import json
import time
from typing import Any

import msgpack
import pytest
from gateways import Peer, join, new_gateway
from websockets.protocol import State

from hapticvlm import __version__
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import (
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    Device,
    Devices,
    Error,
    Frame,
    Models,
    Scene,
    SceneObject,
    Stop,
)
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.recordings.recorder import SESSION_LOG, Recorder
from hapticvlm.server import handshake
from hapticvlm.server.access import Address
from hapticvlm.server.handshake import Handshake, ServiceInfo

LOOPBACK_SLOTS = 4
MAX_CONNECTIONS = 64

PICTURE = Frame(
    id=3,
    captured_at=0.0,
    format="rgb8",
    width=1,
    height=1,
    origin="top",
    image=b"abc",
    object_id="blob",
)
SIMULATED = Device(name="simulated", simulated=True)
VERSIONS = f"speaks protocol 99.3, this service 1.{PROTOCOL_MINOR}"
TOKEN = "long enough to be given off this machine"
OFFER: dict[str, Any] = {
    "devices": Devices(SIMULATED, SIMULATED),
    "models": Models(),
    "table": MATERIALS,
}


@pytest.fixture
def gateway():
    return new_gateway()


def at_the_door(gateway, address=None, **offered):
    return Handshake(address or Address(), gateway, ServiceInfo(**OFFER | offered))


def hello(role="scene", **fields):
    client = {"name": "test", "version": "1"}
    protocol = {"major": PROTOCOL_MAJOR, "minor": 0}
    return {"type": "hello", "id": 1, "client": client, "protocol": protocol, "role": role} | fields


def says(message, **given):
    return Peer(msgpack.packb(message), **given)


async def test_the_setting_of_feel_reaches_the_session_of_a_scene(gateway):
    for feel, basis in (("full", "least_error"), ("graded", "expectation")):
        peer = says(hello())
        connection = await at_the_door(gateway, feel=feel).welcome(peer)
        blob = SceneObject(object_id="blob")
        connection.session.receive(Scene(id=2, objects=[blob], replace=True), 0.0)
        (look,) = connection.session.receive(PICTURE, 1.0)
        unsure = Evidence("encoder", (("metal", 0.4), ("glass", 0.4)))
        (reply,) = connection.session.recognised(look, unsure, {}, 1.1)
        assert reply.message.basis == basis


async def test_the_first_scene_is_welcomed_as_owner_and_the_next_is_not(gateway):
    door = at_the_door(gateway)
    first, second = says(hello()), says(hello())
    connection = await door.welcome(first)
    await door.welcome(second)
    assert gateway.owner is connection
    assert [peer.sent[0]["owner"] for peer in (first, second)] == [True, False]
    assert [each.name for each in gateway.connections] == ["'test' #1", "'test' #2"]
    assert first.sent[0]["id"] == 1
    assert first.sent[0]["service"] == {"name": "hapticvlm", "version": __version__}
    assert first.sent[0]["materials"] == list(MATERIALS)
    assert first.sent[0]["limits"] == {
        "message_bytes": 4_194_304,
        "pixels": 4096,
        "frames_per_s": 90.0,
        "lease_ms": 250,
        "setpoint_c": {"low": 18.0, "high": 40.0},
    }
    assert first.sent[0]["session"] != second.sent[0]["session"]
    assert first.is_greeted


async def test_a_scene_that_connects_again_while_its_old_connection_closes_owns_at_once(gateway):
    door, peer = at_the_door(gateway), says(hello())
    old = await door.welcome(peer)
    peer.state = State.CLOSING
    new = await door.welcome(says(hello()))
    assert (old.session.owner, gateway.owner) == (False, new)
    gateway.leave(old)
    assert gateway.owner is new


async def test_an_observer_owns_nothing_even_when_nobody_does(gateway):
    peer = says(hello("observer"))
    await at_the_door(gateway).welcome(peer)
    assert not peer.sent[0]["owner"]
    assert gateway.owner is None


async def test_a_client_that_speaks_json_is_answered_in_json(gateway):
    peer = Peer(json.dumps(hello()))
    connection = await at_the_door(gateway).welcome(peer)
    assert connection is not None
    assert (peer.sent[0]["type"], peer.is_text) == ("welcome", True)
    connection.send(Error(id=2, code="message", text="no"))
    assert (peer.sent[1]["text"], peer.is_text) == ("no", True)


@pytest.mark.parametrize(
    ("message", "path", "text"),
    [
        ({"type": "stop", "id": 7, "scope": "all"}, "$.type", "send hello first"),
        (hello(id=7, protocol={"major": 99, "minor": 3}), "$.protocol.major", VERSIONS),
        (hello(id=7, role="king"), "$.role", "before hello"),
        (hello(id=7, client={"name": "x" * 20_000, "version": ""}), None, "at most"),
    ],
)
async def test_what_is_no_hello_of_ours_is_named_and_the_socket_closed(
    gateway, message, path, text
):
    peer = says(message)
    assert await at_the_door(gateway).welcome(peer) is None
    (answer,) = peer.sent
    assert (answer["type"], answer["code"], answer.get("path")) == ("error", "protocol", path)
    assert text in answer["text"]
    assert answer["id"] == (7 if path else 0)
    assert peer.closed == (4000, "hello first")
    assert not peer.is_greeted
    assert gateway.connections == []
    assert sum(gateway.counts.values()) == 1


async def test_one_that_stays_silent_is_closed(gateway, monkeypatch):
    monkeypatch.setattr(handshake, "HELLO_S", 0.01)
    peer = Peer()
    assert await at_the_door(gateway).welcome(peer) is None
    assert "no hello within" in peer.sent[0]["text"]
    assert peer.closed is not None


@pytest.mark.parametrize("given", [{}, {"token": "wrong"}, {"token": "rightly"}])
async def test_a_wrong_or_missing_token_is_refused_late_counted_and_logged(
    gateway, monkeypatch, given, caplog
):
    monkeypatch.setattr(handshake, "GUESS_S", 0.02)
    peer, begun = says(hello(**given)), time.monotonic()
    assert await at_the_door(gateway, Address(token="right")).welcome(peer) is None
    assert time.monotonic() - begun >= 0.02
    assert peer.sent[0]["path"] == "$.token"
    assert "right" not in peer.sent[0]["text"].replace("rightly", "")
    assert gateway.counts["refused: token"] == 1
    assert f"a wrong token from {peer.remote_address[0]}\n" in caplog.text


async def test_one_scene_too_many_is_refused_and_an_observer_is_not(gateway):
    for _ in range(3):
        join(gateway)
    door, scene = at_the_door(gateway), says(hello())
    assert await door.welcome(scene) is None
    assert scene.sent[0]["path"] == "$.role"
    assert await door.welcome(says(hello("observer"))) is not None
    assert gateway.counts["refused: no place"] == 1


async def test_the_last_places_are_kept_for_the_dashboard_of_this_machine(gateway):
    crowd(gateway, MAX_CONNECTIONS - LOOPBACK_SLOTS)
    door = at_the_door(gateway)
    assert not has_slot(await door.welcome(says(hello("observer"), address="192.168.1.9")))
    assert not has_slot(await door.welcome(says(hello("scene"))))
    for _ in range(LOOPBACK_SLOTS):
        dashboard = await door.welcome(says(hello("observer")))
        assert has_slot(dashboard)
        dashboard.has_spoken = True
    assert not has_slot(await door.welcome(says(hello("observer"))))
    assert len(gateway.connections) == MAX_CONNECTIONS


def crowd(gateway, count):
    """Observers that have asked for something."""
    for _ in range(count):
        join(gateway, observer=True).has_spoken = True


def has_slot(connection):
    return connection is not None and connection.has_slot


async def test_idle_observers_make_room_the_oldest_first_and_those_that_asked_stay(gateway):
    crowd(gateway, MAX_CONNECTIONS - LOOPBACK_SLOTS - 2)
    oldest, younger = Peer(), Peer()
    for peer in (oldest, younger):
        join(gateway, observer=True, peer=peer)
    assert has_slot(await at_the_door(gateway).welcome(says(hello("scene"))))
    assert oldest.closed == (4002, "made room for another client")
    assert younger.closed is None
    assert gateway.counts["closed: made room"] == 1


async def test_an_observer_that_finds_no_place_is_let_in_to_stop_and_takes_none(gateway):
    crowd(gateway, MAX_CONNECTIONS)
    peer = says(hello("observer"), address="192.168.1.9")
    connection = await at_the_door(gateway).welcome(peer)
    assert connection is not None
    assert not connection.has_slot
    assert peer.sent[0]["type"] == "welcome"
    assert len(gateway.connections) == MAX_CONNECTIONS
    assert gateway.counts["refused: no place"] == 1


async def test_a_client_that_left_before_its_welcome_owns_nothing(gateway):
    assert await at_the_door(gateway).welcome(says(hello(), gone=True)) is None
    assert gateway.connections == []
    assert gateway.owner is None


@pytest.mark.parametrize(
    ("host", "offered", "leaves"),
    [
        ("127.0.0.1", {}, False),
        ("127.0.0.1", {"asks_elsewhere": True}, True),
        ("0.0.0.0", {}, True),
    ],
)
async def test_welcome_says_whether_frames_leave_the_machine(gateway, host, offered, leaves):
    peer = says(hello(token=TOKEN))
    address = Address(host=host, token=TOKEN)
    await at_the_door(gateway, address, **offered).welcome(peer)
    assert peer.sent[0]["privacy"]["frames_leave_machine"] is leaves
    assert not peer.sent[0]["privacy"]["frames_stored"]


async def test_scenes_are_recorded_when_sessions_are_kept_and_observers_are_not(gateway, tmp_path):
    recorder = Recorder(tmp_path, frames=True)
    door = at_the_door(gateway, recorder=recorder)
    peer = says(hello())
    scene, observer = await door.welcome(peer), await door.welcome(says(hello("observer")))
    assert scene is not None
    assert observer is not None
    assert isinstance(scene.session, RecordedSession)
    assert not isinstance(observer.session, RecordedSession)
    assert peer.sent[0]["privacy"]["frames_stored"]
    assert not list(tmp_path.iterdir()), "a scene that only says hello leaves nothing"
    scene.session.receive(Stop(id=2, scope="all"), 0.0)
    recorder.close()
    (kept,) = tmp_path.iterdir()
    assert "head" in (kept / SESSION_LOG).read_text().splitlines()[0]
