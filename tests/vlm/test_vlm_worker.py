"""The service with a vision-language model: asked off the touch path, believed if it says anything.

The models are a real Qwen2-VL of random weights, loaded by the service, and an endpoint on loopback
that says what a test scripts.
"""

import asyncio
import json
import os
import signal
import time
from contextlib import asynccontextmanager, suppress

import pace
import pytest
from conftest import peer, status
from scene_client import OBJECTS, frame, get, until
from serving import endpoint, says, sends
from tiny_llava import write_llava

from hapticvlm.client.local_service import running

pytestmark = [pytest.mark.process, pytest.mark.slow]

PATIENCE_S = 180.0 * pace.PACE  # loading takes seconds, on a busy machine many


def hangs(*_):
    time.sleep(8.0)


def drops(sock, _):
    sock.close()


@pytest.fixture(scope="module")
def loading(tmp_path_factory):
    """A service that loads a model, or has loaded it."""
    tiny = write_llava(tmp_path_factory.mktemp("vlm"), "21")
    with running(["--vlm", str(tiny), "--vlm-timeout", "3"]) as service:
        yield service


def hurrying(claim):
    """Raise the model's process to our own priority whenever it is looked at.

    It runs far below, as it should, and beside two busy tests its imports take minutes there.
    """

    def look(found):
        if (pid := found["vlm"]["pid"]) and hasattr(os, "setpriority"):
            with suppress(PermissionError, ProcessLookupError):
                os.setpriority(os.PRIO_PROCESS, pid, os.getpriority(os.PRIO_PROCESS, 0))
        return claim(found)

    return look


@asynccontextmanager
async def scene(service, **stated):
    async with peer(service) as client:
        await client.hello()
        await client.ask(type="scene", objects=OBJECTS, replace=True, **stated)
        yield client


async def until_shown(service, client, claim):
    """Send frames until the status satisfies `claim`."""
    started = time.monotonic()
    while not claim(status(service)):
        assert time.monotonic() - started < PATIENCE_S, "it never happened"
        await client.ask(**frame(int(time.monotonic())))
        await asyncio.sleep(0.3)


async def until_touched(client, claim):
    """Send frames and touch the table until a decision on it satisfies `claim`."""
    started = time.monotonic()
    while time.monotonic() - started < PATIENCE_S:
        await client.ask(**frame(int(time.monotonic() * 3)))
        await client.touch("release")
        await client.ask(type="set", thermal_gain=(time.monotonic() % 1.0))  # makes it news
        await client.touch("contact", "table")
        found = [e for e in client.events if e["type"] == "decision" and claim(e)]
        if found:
            return found[-1]
        client.events.clear()
        await asyncio.sleep(0.2)
    raise AssertionError("no such decision")


@pytest.fixture(scope="module")
def told():
    """A service whose endpoint says 31 degC, and that endpoint."""
    with endpoint(says("31 °C")) as served, running(["--vlm-url", served.url]) as service:
        yield service, served


async def test_a_scene_that_states_its_ambient_is_never_asked_about(told):
    service, served = told
    async with scene(service, ambient_c=12.0) as client:
        for number in range(40):
            await client.ask(**frame(number))
            await asyncio.sleep(0.05)
        await client.touch("contact", "table")
        decision = await client.event("decision", object_id="table")
    assert (decision["ambient_source"], decision["ambient_c"]) == ("scene", 12.0)
    assert not [asked for asked in served.questions if "°C" in json.dumps(asked)]


async def test_an_endpoints_reading_is_felt_labelled_and_stated_in_welcome(told):
    service, _ = told
    async with scene(service) as client:
        assert client.welcome["privacy"]["frames_leave_machine"]
        assert client.welcome["models"]["vlm"].startswith("Qwen")
        decision = await until_touched(client, lambda d: d["ambient_source"] == "vlm")
    assert decision["ambient_c"] == 31.0
    assert decision["ambient_low_c"] <= decision["ambient_c"] <= decision["ambient_high_c"]
    assert decision["surface_c"] == pytest.approx(decision["ambient_c"])
    assert any("frames are sent there" in line for line in service.printed)


@pytest.mark.parametrize(
    ("reply", "name"),
    [(drops, "down"), (says("lovely weather"), "nonsense"), (hangs, "hanging")],
)
async def test_a_failing_endpoint_leaves_the_labelled_default_and_touches_are_answered(reply, name):
    with (
        endpoint(reply) as served,
        running(["--vlm-url", served.url, "--vlm-timeout", "1"]) as service,
    ):
        async with scene(service) as client:
            await client.ask(**frame(1))
            await until(service, lambda found: found["vlm"]["failed"] >= 1, PATIENCE_S)
            started = time.monotonic()
            for number in range(20):
                await client.touch("contact" if number == 0 else "slide", "table")
            assert time.monotonic() - started < 5.0, name
            decision = await client.event("decision", object_id="table")
        found = status(service)["vlm"]
    assert decision["ambient_source"] == "default"
    assert (decision["ambient_c"], decision["ambient_low_c"]) == (22.0, 18.0)
    assert found["last_error"]
    assert found["answered"] == 0


async def test_a_scene_is_told_that_its_model_fails_and_what_can_be_done():
    def unauthorised(sock, request):
        sends('{"error": "wrong key"}', "401 Unauthorized")(sock, request)

    with endpoint(unauthorised) as served, running(["--vlm-url", served.url]) as service:
        async with scene(service) as client:
            await client.ask(**frame(1))
            error = await client.event("error", code="model")
        with get(service, "/metrics") as answer:
            metrics = answer.read().decode()
        pace.until(lambda: any("HTTP 401: wrong key" in line for line in service.printed))
    assert "fails: the endpoint answers HTTP 401: wrong key" in error["text"]
    assert "HAPTICVLM_VLM_TOKEN holds no token" in error["text"]
    assert "hapticvlm_vlm_failed_total 1.0" in metrics


LIKELY = "plastic"  # to the encoder too, but not enough to be named by it alone


def answers_by_question(sock, request):
    """Say 21 of a scene and glass of an object."""
    asked = json.dumps(request.body)
    (says(LIKELY) if "made of" in asked else says("21"))(sock, request)


async def test_an_object_the_encoder_leaves_unknown_is_asked_about_once_and_decided():
    with endpoint(answers_by_question) as served, running(["--vlm-url", served.url]) as service:
        async with scene(service) as client:
            object_frame = {
                "object_id": "thing",
                "region": {"x": 0.1, "y": 0.1, "w": 0.8, "h": 0.8},
            }
            await client.ask(type="scene", objects=[{"object_id": "Object_1"}], replace=True)
            object_frame["object_id"] = "Object_1"
            first = await client.ask(**frame(5, **object_frame))
            assert first["material"] == "unknown"
            async with asyncio.timeout(PATIENCE_S):
                await until(service, lambda found: found["vlm"]["answered"] >= 2, PATIENCE_S)
                await client.touch("contact", "Object_1")
                decision = await client.event("decision", object_id="Object_1", material=LIKELY)
            assert decision["source"] == "vlm"
            assert "vlm" in [item["rung"] for item in decision["evidence"]]
            for number in range(5):
                await client.ask(**frame(50 + number, **object_frame))
        made_of = [asked for asked in served.questions if "made of" in json.dumps(asked)]
    assert len(made_of) == 1


async def test_a_model_loaded_here_answers_and_no_frame_leaves_the_machine(loading):
    assert loading.seconds_to_ready < PATIENCE_S  # it loads while the service already runs
    async with scene(loading) as client:
        assert not client.welcome["privacy"]["frames_leave_machine"]
        await until(loading, hurrying(lambda found: found["vlm"]["name"]), PATIENCE_S)
        await until_shown(loading, client, lambda found: found["vlm"]["answered"] >= 1)
        decision = await until_touched(client, lambda d: d["object_id"] == "table")
    found = status(loading)["vlm"]
    assert decision["ambient_source"] in ("vlm", "default")  # the touch may be the quicker one
    assert found["last_error"] is None
    assert not found["remote"]


@pytest.mark.nightly
async def test_a_killed_or_frozen_model_is_restarted_reported_and_asked_again(loading):
    is_ready = hurrying(lambda found: found["vlm"]["name"] and not found["vlm"]["busy"])
    async with scene(loading) as client:
        await until(loading, is_ready, PATIENCE_S)
        killed = status(loading)["vlm"]["pid"]
        os.kill(killed, signal.SIGKILL)
        error = await client.event("error", code="model")
        assert "vlm" in error["text"]
        await until(loading, is_ready, PATIENCE_S)
        frozen = status(loading)["vlm"]["pid"]
        assert frozen != killed
        os.kill(frozen, signal.SIGSTOP)
        await until_shown(loading, client, lambda found: found["vlm"]["failed"] >= 1)
        assert status(loading)["vlm"]["restarts"] >= 2
        await client.touch("contact", "table")
        decision = await client.event("decision", object_id="table")
        assert decision["ambient_source"] == "default"


@pytest.mark.nightly
async def test_a_model_that_cannot_be_loaded_is_given_up_and_reported(tmp_path):
    with running(["--vlm", str(tmp_path / "nothing")]) as service:
        async with scene(service) as client:
            await until(service, lambda found: found["vlm"]["absent"], PATIENCE_S)
            await client.ask(**frame(1))
            await client.touch("contact", "table")
            decision = await client.event("decision", object_id="table")
        found = status(service)["vlm"]
    assert decision["ambient_source"] == "default"
    assert "nothing" in found["absent"]
    assert found["restarts"] == 2
