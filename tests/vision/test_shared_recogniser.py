"""The service with a shared recogniser that answers, fails and comes back; without Ray."""

import asyncio
import time

import psutil
import pytest
from conftest import EVENT_S, peer, status
from pace import until
from scene_client import OBJECTS, frame, get
from shared_looks import is_shared, look, recognising_ms, scene, until_shared
from shared_recogniser import shared_recogniser

from hapticvlm.client.local_service import running

pytestmark = [pytest.mark.process, pytest.mark.realtime]

DEADLINE_S = 0.8  # wide, for a busy machine
MOST_MS = 1000.0 * DEADLINE_S
TRIES = 3  # a busy machine may let a process wait for longer than any deadline
NOTHING_MS = 200.0  # of a busy machine, for what takes microseconds


@pytest.fixture(scope="module")
def shared():
    with shared_recogniser() as served:
        yield served


@pytest.fixture(scope="module")
def sharing(shared):
    arguments = ["--recogniser-url", shared.url, "--recogniser-deadline", str(DEADLINE_S)]
    with running(arguments) as service:
        yield service


async def test_a_service_keeps_no_recogniser_of_its_own_until_the_shared_one_fails():
    with shared_recogniser() as shared:
        # The deadline is far beyond any answer, so that no pause of this machine counts as a fault.
        arguments = ["--recogniser-url", shared.url, "--recogniser-deadline", "5"]
        with running(arguments) as service:
            async with scene(service) as client:
                assert is_shared(await look(client))
                assert held_mb(service) < 140.0
                assert not has_loaded_a_network(service)
                shared.fault = "fails"
                assert not is_shared(await look(client))
                assert has_loaded_a_network(service)


def processes(service):
    first = psutil.Process(service.process.pid)
    return [first, *first.children(recursive=True)]


def held_mb(service):
    """Return the memory of all processes of a service, MB, shared pages counted once."""
    return sum(each.memory_full_info().pss for each in processes(service)) / 1e6


def has_loaded_a_network(service):
    files = [file.path for each in processes(service) for file in each.memory_maps()]
    return any("onnxruntime" in path for path in files)


@pytest.mark.nightly
async def test_crops_are_recognised_remotely_and_the_state_is_reported(shared, sharing):
    async with scene(sharing) as client:
        assert client.welcome["privacy"]["crops_leave_machine"]
        assert not client.welcome["privacy"]["frames_leave_machine"]
        await until_shared(client)
        answer = await look(client)
        assert [item["rung"] for item in answer["evidence"]] == ["encoder"]
        told = status(sharing)["recogniser"]["remote"]
        assert told["is_used"]
        assert told["identity"].endswith(shared.url.removeprefix("http://"))
    assert any("crops are sent there" in line for line in sharing.printed)


@pytest.mark.nightly
@pytest.mark.parametrize("fault", ["hangs", "garbage", "wrong hash"])
async def test_a_fault_is_answered_here_within_one_deadline_and_ends_by_itself(
    shared, sharing, fault
):
    async with scene(sharing) as client:
        took: list[float] = []
        while not took or (min(took) > MOST_MS and len(took) < TRIES):
            await until_shared(client)
            before = said_here(sharing)
            shared.fault = fault
            try:
                first = await look(client)
                assert not is_shared(first)
                took.append(recognising_ms(first))
                rest = [await look(client) for _ in range(3)]
                assert all(answer["stages_ms"]["remote"] < NOTHING_MS for answer in rest)
                told = status(sharing)["recogniser"]["remote"]
                assert not told["is_used"]
                assert told["reason"]
                until(lambda before=before: said_here(sharing) > before)  # type: ignore[misc]
                assert said_here(sharing) == before + 1, "one line for one fault"
            finally:
                shared.fault = None
        await until_shared(client)
    assert min(took) < MOST_MS, took
    assert status(sharing)["recogniser"]["restarts"] == 0


def said_here(service):
    return sum("on this machine" in line for line in service.printed)


async def test_without_the_flag_no_crop_is_sent_and_no_state_reported():
    with running() as service:
        async with scene(service) as client:
            assert not client.welcome["privacy"].get("crops_leave_machine", False)
            assert "remote" not in (await look(client))["stages_ms"]
        assert status(service)["recogniser"]["remote"] is None


@pytest.mark.nightly
async def test_a_scene_is_told_that_its_shared_recogniser_fails_and_what_can_be_done():
    with shared_recogniser() as shared:
        shared.token = "a token of someone else's"
        with running(["--recogniser-url", shared.url]) as service:
            async with peer(service) as client:
                await client.hello()
                await client.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
                async with asyncio.timeout(EVENT_S):
                    while not (
                        errors := [
                            event["text"] for event in client.events if event["type"] == "error"
                        ]
                    ):
                        await client.ask(**frame(time.monotonic_ns() % 2**32, object_id="thing"))
                        await client.telemetry()
                with get(service, "/metrics") as answer:
                    metrics = answer.read().decode()
    assert "the shared recogniser fails" in errors[0]
    assert "HAPTICVLM_RECOGNISER_TOKEN" in errors[0]
    assert "pictures are recognised here" in errors[0]
    assert "hapticvlm_shared_recogniser_failed_total 0.0" not in metrics
