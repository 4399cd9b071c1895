"""What is left of a client that has gone: nothing, and without a collection of cycles."""

import asyncio
import weakref

import pytest
from collecting import no_collection
from gateways import new_gateway, server_of
from pace import PACE
from websockets.asyncio.client import connect

from hapticvlm.messages import (
    Feel,
    Hello,
    Party,
    ProtocolVersion,
    Scene,
    SceneObject,
    Set,
    Touch,
    encode,
)

GONE_S = 5.0 * PACE
SCENE = (
    Scene(id=2, objects=[SceneObject(object_id="table", name="Oak_Table")], replace=True),
    Set(id=3, feel=Feel(right="amplitude"), watch=["frames", "log"]),
    Touch(
        id=4,
        phase="contact",
        object_id="table",
        hand="right",
        speed_mps=0.3,
        force_n=1.0,
        captured_at=1.0,
    ),
)
OBSERVER = (Set(id=2, watch=["waveform"]),)


@pytest.mark.parametrize(("role", "said"), [("scene", SCENE), ("observer", OBSERVER)])
async def test_a_client_that_has_left_is_forgotten_with_its_session(role, said):
    gateway = new_gateway()
    version = ProtocolVersion(major=1, minor=0)
    hello = Hello(id=1, client=Party(name="test", version="1"), protocol=version, role=role)
    with no_collection():
        async with server_of(gateway).listen() as port:
            async with connect(f"ws://127.0.0.1:{port}", proxy=None) as socket:
                for message in (hello, *said):
                    await socket.send(encode(message, as_text=True))
                    await socket.recv()
                (connection,) = gateway.connections
                kept = [weakref.ref(each) for each in (connection, connection.session)]
                del connection
            async with asyncio.timeout(GONE_S):
                while any(each() is not None for each in kept):  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
