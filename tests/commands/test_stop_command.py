"""`hapticvlm stop` stops a running service's outputs, or reports why it could not."""

import asyncio
import json

import pytest
from conftest import peer, status
from in_process import hapticvlm
from pace import until

from hapticvlm.client.local_service import running


@pytest.fixture(scope="module")
def service():
    with running(["--token", "a token of twelve"]) as service:
        yield service


async def test_it_brings_the_outputs_of_another_owner_to_rest(service):
    async with peer(service) as client:
        await client.hello(token="a token of twelve")
        objects = [{"object_id": "t", "material": "wood"}]
        await client.ask(type="scene", objects=objects, replace=True)
        await client.ask(
            type="touch",
            phase="contact",
            object_id="t",
            hand="right",
            speed_mps=0.3,
            force_n=1.0,
            captured_at=0.0,
        )
        ask = ("stop", "--url", service.url, "--token", "a token of twelve")
        done = await asyncio.to_thread(hapticvlm, *ask)
        held = status(service)["held"]
    assert done.code == 0, done.err
    ended = "the vibration has ended and the current of the plate is cut"
    assert done.out == f"stopped: {ended}; a new touch starts them again\n"
    assert held["right"], held
    until(lambda: any("'hapticvlm stop' #2 connected as observer" in s for s in service.printed))


def test_one_output_can_be_stopped_alone_and_a_wrong_token_stops_nothing(service):
    ask = ["stop", "speaker", "--url", service.url, "--token"]
    done = hapticvlm(*ask, "a token of twelve")
    assert done.out == "stopped: the vibration has ended; a new touch starts them again\n"
    done = hapticvlm(*ask, "a token of twelve", "--json")
    assert (done.code, json.loads(done.out)) == (0, {"stopped": "speaker"})
    done = hapticvlm("stop", "peltier", *ask[2:], "a token of twelve")
    assert done.out == "stopped: the current of the plate is cut; a new touch starts them again\n"
    for arguments, told in (
        ([*ask, "not the token here"], "token"),
        (["stop", "--url", "ws://127.0.0.1:9/"], "nothing listens there; nothing was stopped"),
    ):
        done = hapticvlm(*arguments)
        assert done.code == 2
        assert told in done.err
        assert len(done.err.strip().splitlines()) == 1
