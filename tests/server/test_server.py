"""The running service over real WebSockets: admission, ownership, touches, frames, stopping."""

import asyncio
import contextlib
import io
import time
import urllib.error
import urllib.request
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest
from conftest import peer, status
from pace import PACE
from PIL import Image
from scene_client import OBJECTS, frame, get, is_silent, owner_of, picture, quickest, rests, until
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosedError, InvalidStatus

from hapticvlm.client.local_service import ServiceError, running
from hapticvlm.commands.main import main
from hapticvlm.messages import PROTOCOL_MINOR
from hapticvlm.server.edge.limits import RECOGNITION_RATE

MAX_CONNECTIONS = 64


def mask(side=64):
    buffer = io.BytesIO()
    Image.fromarray(np.pad(np.full((32, 32), 255, np.uint8), (side - 32) // 2)).save(buffer, "PNG")
    return buffer.getvalue()


async def test_hello_is_answered_by_welcome_with_limits_devices_and_privacy(service):
    async with peer(service) as client:
        newer = {"major": 1, "minor": PROTOCOL_MINOR + 7}
        welcome = await client.hello(protocol=newer)
    assert (welcome["type"], welcome["id"]) == ("welcome", 1)
    assert welcome["protocol"] == {"major": 1, "minor": PROTOCOL_MINOR}
    assert welcome["limits"]["message_bytes"] == 4 * 1024 * 1024
    assert welcome["limits"]["setpoint_c"] == {"low": 18.0, "high": 40.0}
    assert welcome["devices"]["speaker"]["simulated"]
    assert welcome["devices"]["peltier"]["simulated"]
    assert "wood" in welcome["materials"]
    assert welcome["privacy"] == {"frames_stored": False, "frames_leave_machine": False}


@pytest.mark.realtime
async def test_a_touch_is_felt_and_ends_with_its_lease(service):
    async with peer(service) as client:
        await owner_of(client)
        assert (await client.touch("contact", "table"))["type"] == "ok"
        decision = await client.event("decision", object_id="table")
        assert (decision["material"], decision["source"]) == ("wood", "scene")
        await until(service, lambda found: not is_silent(found))

        async def rub():
            for number in range(10):
                await client.touch("slide" if number else "contact", "table")
                await asyncio.sleep(0.05)
            assert status(service)["leases"] == 1

        limit_s = 0.25 + 0.05 + 0.05  # lease, fade and tick, polling
        assert await quickest(service, rub, rests, limit_s) < limit_s


@pytest.mark.realtime
async def test_a_release_is_silent_within_a_fade(service):
    async with peer(service) as client:
        await owner_of(client)

        async def touch_and_release():
            await client.touch("contact", "table")
            await client.touch("slide", "table")
            await client.touch("release")

        assert await quickest(service, touch_and_release, is_silent, 0.2) < 0.2


async def test_a_contact_that_comes_too_late_to_strike_is_counted_in_the_status(service):
    async with peer(service) as client:
        await client.hello()
        await client.ask(type="scene", objects=OBJECTS, replace=True)
        await client.touch("approach", "table")
        await asyncio.sleep(0.05)
        left = time.monotonic()
        await client.touch("release", "table", captured_at=left)
        await asyncio.sleep(0.5)
        late = await client.touch("contact", "table", captured_at=left)
        assert late["type"] == "ok"
        assert status(service)["counts"]["contacts too late to strike"] == 1
    await until(service, lambda found: not found["connections"])
    assert status(service)["counts"]["contacts too late to strike"] == 1


@pytest.mark.realtime
async def test_stop_from_an_observer_rests_everything_until_release_and_a_new_contact(service):
    async with peer(service) as client, peer(service) as observer:
        await owner_of(client)
        await observer.hello("observer")

        async def touch_and_stop():
            await client.touch("release")  # a stop holds until then
            await client.touch("contact", "kettle")
            await client.touch("slide", "kettle")
            assert (await observer.ask(type="stop", scope="all"))["type"] == "ok"

        assert await quickest(service, touch_and_stop, rests, 0.1) < 0.1
        refused = await client.touch("slide", "kettle")
        assert refused["code"] == "unsafe"
        assert "release" in refused["text"]
        assert (await client.touch("release"))["type"] == "ok"
        assert (await client.touch("contact", "kettle"))["type"] == "ok"


async def test_the_status_names_what_each_hand_still_waits_for_after_a_stop(service):
    async with peer(service) as client:
        await owner_of(client)
        await client.ask(type="stop", scope="all")
        both = ["speaker", "peltier"]
        assert status(service)["held"] == {"left": both, "right": both}
        await client.touch("release")
        await client.touch("contact", "table")
        assert status(service)["held"] == {"left": both, "right": []}
        await client.touch("release", hand="left")
        assert status(service)["held"] == {"left": both, "right": []}
        await client.touch("contact", "table", hand="left")
        assert status(service)["held"] == {"left": [], "right": []}
        await client.ask(type="stop", scope="peltier")
        assert status(service)["held"] == {"left": ["peltier"], "right": ["peltier"]}


async def test_a_stop_outlives_the_scene_that_was_stopped(service):
    async with peer(service) as client:
        await owner_of(client)
        await client.ask(type="stop", scope="all")
    async with peer(service) as again:
        await again.hello()
        assert (await again.touch("contact", "table"))["code"] == "unsafe"
        await again.touch("release")
        assert (await again.touch("contact", "table"))["type"] == "ok"


@pytest.mark.realtime
async def test_a_clean_close_rests_the_outputs(service):
    async def touch_and_leave():
        async with peer(service) as client:
            await owner_of(client)
            await client.touch("contact", "kettle")
            await client.touch("slide", "kettle", speed_mps=0.5)

    def is_left(found):
        return is_silent(found) and found["owner"] is None

    assert await quickest(service, touch_and_leave, is_left, 0.2) < 0.2


async def test_a_frame_is_decided_or_skipped_and_a_broken_one_is_an_error(service):
    async with peer(service) as client:
        await owner_of(client)

        async def said(**fields):
            answer = await client.ask(**frame(**{"object_id": "thing", **fields}))
            return answer, (answer["type"], answer.get("reason"))

        first, kind = await said(seed=1)
        assert (kind, first["object_id"]) == (("decision", None), "thing")
        assert {"decode", "encode", "match"} <= first["stages_ms"].keys()
        assert (await said(seed=1))[1] == ("skipped", "unchanged")
        old = {"captured_at": time.monotonic() - 5.0, "max_age_ms": 100.0}
        assert (await said(seed=2, **old))[1] == ("skipped", "stale")
        whole = picture(3)
        broken, kind = await said(image=whole[: len(whole) // 2])
        assert (kind, bool(broken["path"])) == (("error", None), True)
        assert (await said(seed=4))[1] == ("decision", None)


async def test_what_is_known_is_looked_at_twenty_times_a_second_and_the_last_frame_always(service):
    async with peer(service) as client:
        await owner_of(client)
        assert (await client.ask(**frame(0, object_id="thing")))["type"] == "decision"
        started = time.monotonic()
        ids = []
        for number in range(1, 90):
            await asyncio.sleep(max(0.0, started + number / 60.0 - time.monotonic()))
            ids.append(await client.send(**frame(number, object_id="thing")))
        last = [frame(number, object_id="thing") for number in (90, 91, 92)]
        ids += [await client.send(**message) for message in last]  # before another look is due
        answers: dict[int, dict[str, Any]] = {}
        # nothing more comes, and yet the last one is looked at
        async with asyncio.timeout(10.0 * PACE):
            while len(answers) < len(ids):
                answer = await client.read()
                if answer["id"] in ids:
                    answers[answer["id"]] = answer
        lasted_s = time.monotonic() - started
    decided = [id for id in ids if answers[id]["type"] == "decision"]
    assert decided[-1] == ids[-1]
    allowed = RECOGNITION_RATE.burst + RECOGNITION_RATE.per_s * lasted_s
    assert len(decided) <= allowed
    assert len(decided) >= 10 / PACE  # as many as this machine can beside other work


async def test_only_the_observer_that_asked_sees_frames_waveform_and_log(service):
    async with (
        peer(service) as client,
        peer(service) as watching,
        peer(service) as other,
    ):
        await owner_of(client)
        await watching.hello("observer")
        await other.hello("observer")
        await watching.ask(type="set", watch=["frames", "waveform", "log"])
        await asyncio.sleep(0.6)
        await client.ask(**frame(9, object_id="thing", mask=mask()))
        async with asyncio.timeout(3.0 * PACE):
            assert (await watching.event("view", kind="waveform"))["id"] == 0
            view = await watching.event("view", kind="frames", object_id="thing")
            assert (view["id"], view["mask"]) == (0, mask())
            async with peer(service) as newcomer:
                await newcomer.hello("observer")
            assert "connected" in (await watching.event("view", kind="log"))["text"]
        decision = await other.event("decision", object_id="thing")
        assert (decision["id"], decision["name"]) == (0, "Object_07")
        await other.telemetry()
        assert not [event for event in other.events if event["type"] == "view"]


async def test_a_watcher_of_the_waveform_sees_what_the_hand_does_now(service):
    async with peer(service) as client, peer(service) as watching:
        await owner_of(client)
        await watching.hello("observer")
        await watching.ask(type="set", watch=["waveform"])
        view = await watching.event("view", kind="waveform")
        assert view.get("speed_mps") is None
        await client.touch("slide", "kettle", speed_mps=0.25)
        view = await watching.event("view", object_id="kettle")
        assert view["speed_mps"] == 0.25
        await client.touch("release", "kettle")
        async with asyncio.timeout(3.0 * PACE):
            while view.get("speed_mps") is not None:
                view = await watching.event("view", kind="waveform")
        assert view.get("object_id") is None


async def test_waveform_pieces_follow_each_other_without_gap_or_overlap(service):
    async with peer(service) as client, peer(service) as watching:
        await owner_of(client)
        await watching.hello("observer")
        await watching.ask(type="set", watch=["waveform"])
        await client.touch("contact", "kettle")
        pieces = [await watching.event("view", kind="waveform") for _ in range(12)]
    ends = [piece["start"] + len(piece["samples"]) for piece in pieces]
    assert [piece["start"] for piece in pieces[1:]] == ends[:-1]
    assert max(abs(sample) for piece in pieces for sample in piece["samples"]) > 0.001
    assert all(len(piece["samples"]) / piece["rate_hz"] <= 0.1 for piece in pieces)


async def test_a_message_over_the_limit_closes_with_1009_and_is_counted(service):
    async with peer(service) as client:
        await client.hello()
        await client.socket.send(b"\x00" * (4 * 1024 * 1024 + 1))
        with pytest.raises(ConnectionClosedError) as closed:
            await client.event("never")
        await client.socket.wait_closed()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1009
    await until(service, lambda found: found["counts"].get("closed: message too big", 0) >= 1)


@pytest.mark.realtime
async def test_a_client_that_does_not_read_delays_nobody(service):
    async with peer(service) as lazy, peer(service) as client:
        await lazy.hello("observer")
        lazy.socket.transport.pause_reading()
        await owner_of(client)
        took = []
        for _ in range(50):
            started = time.monotonic()
            await client.touch("contact", "table")
            took.append(time.monotonic() - started)
        assert sorted(took)[25] < 0.05
        lazy.socket.transport.resume_reading()


@pytest.mark.parametrize(
    ("origin", "admitted"),
    [
        (None, True),
        ("http://localhost:5173", True),
        ("http://127.0.0.1", True),
        ("https://[::1]:8443", True),
        ("https://evil.example", False),
        ("http://localhost.evil.example", False),
        ("null", False),
        ("http://[broken", False),
    ],
)
async def test_only_absent_and_loopback_origins_are_admitted(service, origin, admitted):
    headers = {} if origin is None else {"Origin": origin}
    expected = nullcontext() if admitted else pytest.raises(InvalidStatus, match="403")
    with expected:
        async with open_socket(service.url, proxy=None, additional_headers=headers):
            pass


async def test_a_token_is_asked_for_when_one_is_set():
    with running(["--token", "s3cret", "--allow-origin", "https://good.example"]) as service:
        async with peer(service) as client:
            assert (await client.hello())["code"] == "protocol"
        async with peer(service, additional_headers={"Origin": "https://good.example"}) as client:
            assert (await client.hello(token="s3cret"))["type"] == "welcome"


def test_an_unknown_encoder_or_speaker_is_a_clear_error_at_start():
    for options, said in (
        (["--encoder", "nobody/nothing"], "encoder"),
        (["--speaker", "no such one"], "audio output"),
    ):
        with pytest.raises(ServiceError, match=said), running(options):
            pass


def test_a_page_of_another_site_loads_nothing_of_ours_and_may_embed_nothing(service):
    with pytest.raises(urllib.error.HTTPError) as refused:
        get(service, "/icon.svg", **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"})
    assert refused.value.code == 403
    refused.value.close()
    with get(service, "/") as page:
        assert page.headers["Cross-Origin-Resource-Policy"] == "same-origin"


async def test_a_refused_page_is_logged_once_with_what_to_do():
    with running() as service:
        for _ in range(2):
            for origin in ("https://shop.example", "null"):
                with pytest.raises(InvalidStatus) as refused:
                    async with peer(service, additional_headers={"Origin": origin}):
                        pass
                assert refused.value.response.status_code == 403
                assert "--allow-origin null" not in refused.value.response.body.decode()
    logged = [line for line in service.printed if "refused a page" in line]
    assert len(logged) == 2
    assert "--allow-origin https://shop.example" in logged[0]


async def test_a_crowd_of_observers_does_not_lock_stop_out():
    async with contextlib.AsyncExitStack() as stack:
        service = stack.enter_context(running())

        async def observer():
            client = await stack.enter_async_context(peer(service))
            assert (await client.hello("observer"))["type"] == "welcome"
            return client

        for _ in range(MAX_CONNECTIONS):
            await (await observer()).ask(type="set", watch=["log"])
        assert await asyncio.to_thread(main, ["stop", "--url", service.url]) == 0
        late = await observer()
        assert "close one" in (await late.ask(type="set", watch=["log"]))["text"]
        await late.socket.wait_closed()
        assert late.socket.close_code == 4003
        await until(service, lambda found: found["connections"] == MAX_CONNECTIONS)
