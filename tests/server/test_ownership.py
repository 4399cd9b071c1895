"""Who is felt, over real WebSockets: scenes that close, reconnect, wait and take over."""

import asyncio
import os

from conftest import ANSWER_S, peer

TABLE = {"object_id": "table", "material": "wood"}
TIMES = int(os.environ.get("RECONNECTS", "10"))  # 100 before a release


async def begin(client):
    """Say hello and describe a scene; return whether it owns the outputs."""
    welcome = await client.hello()
    await client.ask(type="scene", objects=[TABLE], replace=True)
    return welcome["owner"]


async def feels(client):
    """Rub the table until a vibration comes of it."""
    assert (await client.ask(type="set", feel={"right": "amplitude"}))["type"] == "ok"
    await client.touch("release")
    assert (await client.touch("contact", "table"))["type"] == "ok"
    async with asyncio.timeout(ANSWER_S):
        while not [each for each in client.events if each.get("amplitude")]:
            assert (await client.touch("slide", "table"))["type"] == "ok"
            await asyncio.sleep(0.01)


async def test_a_scene_that_closes_and_connects_again_at_once_owns_the_outputs(service):
    owned = 0
    for _ in range(TIMES):
        async with peer(service) as client:
            owned += await begin(client)
            await feels(client)
    assert owned == TIMES


async def test_a_scene_that_is_cut_off_and_comes_back_owns_the_outputs_in_the_end(service):
    for _ in range(TIMES):
        async with peer(service) as client:
            await begin(client)
            client.socket.transport.abort()
        async with peer(service) as client:
            if not await begin(client):
                assert (await client.event("ownership"))["free"]
                assert (await client.ask(type="set", ownership="take"))["type"] == "ok"
            await feels(client)


async def test_a_waiting_scene_is_offered_the_outputs_takes_them_and_is_felt(service):
    async with peer(service) as waiting, peer(service) as other:
        async with peer(service) as first:
            assert await begin(first)
            assert not await begin(waiting)
            assert not await begin(other)
            assert (await waiting.touch("contact", "table"))["code"] == "not_owner"
        offered = await waiting.event("ownership")
        assert (offered["id"], offered["owner"], offered["free"]) == (0, False, True)
        assert (await waiting.ask(type="set", ownership="take"))["type"] == "ok"
        assert (await other.event("ownership", free=False))["owner"] is False
        await feels(waiting)
