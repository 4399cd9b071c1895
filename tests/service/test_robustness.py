"""What may go wrong around the service, with real processes: nothing stays on, nothing is lost."""

import asyncio
import contextlib
import io
import os
import random
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import peer, status
from pace import PACE
from PIL import Image
from run import mutated, seeds
from scene_client import (
    frame,
    is_silent,
    owner_of,
    quickest,
    rests,
    touching_client,
    until,
)

from hapticvlm.client.local_service import running
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import MessageError
from hapticvlm.partial_messages import decode
from hapticvlm.vision.worker import LIMIT_S

LEASE_S = 0.25
RESTART_S = 20.0 * PACE  # a second failure within ten seconds waits a second


def plays_anew(found, before):
    """Whether the audio engine was restarted since `before` and is up."""
    return found["speaker"]["plays"] and found["speaker"]["pid"] != before["pid"]


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("name", "kill"), [("killed", signal.SIGKILL), ("frozen, its socket half-open", signal.SIGSTOP)]
)
async def test_outputs_rest_within_the_lease_and_50_ms_of_a_client_being(service, name, kill):
    limit_s = LEASE_S + 0.05 + 0.03  # and the time a poll takes
    processes: list[subprocess.Popen[str]] = []

    async def end_a_client():
        for earlier in processes:
            earlier.kill()
        await until(service, lambda found: found["owner"] is None)
        processes.append(touching_client(service))
        found = status(service)
        assert not is_silent(found), name
        assert found["plate"]["setpoint_c"] < 32.0
        processes[-1].send_signal(kill)

    try:
        assert await quickest(service, end_a_client, rests, limit_s) < limit_s
        await until(service, lambda found: found["plate"]["setpoint_c"] == 32.0, 10.0)
    finally:
        for process in processes:
            process.kill()
            process.wait()
    await until(service, lambda found: found["owner"] is None)


async def test_a_killed_audio_engine_is_restarted_reported_and_felt_again(service):
    async with peer(service) as client:
        await owner_of(client)
        before = status(service)["speaker"]
        os.kill(before["pid"], signal.SIGKILL)
        error = await client.event("error", code="device")
        assert "audio engine" in error["text"]
        await until(service, lambda found: plays_anew(found, before), RESTART_S)
        await client.touch("contact", "table")
        await until(service, lambda found: not is_silent(found))


def classes_of_threads(pid: int) -> set[int]:
    threads = Path(f"/proc/{pid}/task").iterdir()
    return {os.sched_getscheduler(int(thread.name)) for thread in threads}


@pytest.mark.skipif(sys.platform != "linux", reason="scheduling classes of Linux")
async def test_a_recogniser_that_is_woken_puts_nobody_aside(service):
    """So a frame that the gateway hands over does not hold the touch that comes with it."""
    await until(service, lambda found: found["recogniser"]["pid"] is not None, RESTART_S)
    pid = status(service)["recogniser"]["pid"]
    assert classes_of_threads(pid) == {os.SCHED_BATCH}


async def test_a_killed_recogniser_is_restarted_reported_and_decides_again(service):
    async with peer(service) as client:
        await owner_of(client)
        os.kill(status(service)["recogniser"]["pid"], signal.SIGKILL)
        assert (await client.touch("contact", "table"))["type"] == "ok"
        error = await client.event("error", code="model")
        assert "recogniser" in error["text"]
        async with asyncio.timeout(10.0 * PACE):
            assert (await client.ask(**frame(77, object_id="thing")))["type"] == "decision"


@pytest.mark.realtime
async def test_a_frozen_recogniser_is_ended_after_its_limit_and_its_frame_is_answered(service):
    async with peer(service) as client:
        await owner_of(client)
        frozen = status(service)["recogniser"]["pid"]
        os.kill(frozen, signal.SIGSTOP)
        started = time.monotonic()
        answer = await client.ask(**frame(78, object_id="thing"))
        assert (answer["type"], answer["code"]) == ("error", "model")
        assert time.monotonic() - started < LIMIT_S + 3.0  # 20 s before
        assert (await client.touch("contact", "table"))["type"] == "ok"
        await until(
            service, lambda found: found["recogniser"]["pid"] not in (None, frozen), RESTART_S
        )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_rests_the_outputs_before_the_service_exits(tmp_path, number):
    import soundfile

    wav = tmp_path / "played.wav"
    with running(["--wav", str(wav)]) as service:
        client = touching_client(service)
        engine = status(service)["speaker"]["pid"]
        service.process.send_signal(number)
        assert service.process.wait(10.0 * PACE) == 0
        client.wait(10.0 * PACE)
    assert any("outputs at rest" in line for line in service.printed)
    with pytest.raises(ProcessLookupError):
        os.kill(engine, 0)
    played, rate = soundfile.read(wav)
    assert abs(played).max() > 0.01
    assert abs(played[-rate // 200 :]).max() < 1e-3


def is_taken_in_part(data):
    """Whether the good part of a message that is not in order is felt (test_partial_messages)."""
    try:
        decode(data, MATERIALS)
    except MessageError:
        return False
    return True


async def test_a_thousand_random_and_mutated_messages_each_get_an_answer_and_change_nothing(
    service,
):
    rng, corpus, refused = random.Random(20261121), seeds("messages"), 0
    async with peer(service) as client:
        await owner_of(client)
        await until(service, lambda found: found["plate"]["setpoint_c"] == 32.0)  # of tests before
        before = status(service)
        while refused < 1000:
            raw = mutated(rng, corpus) if rng.random() < 0.7 else rng.randbytes(200)
            data: bytes | str = raw
            with contextlib.suppress(UnicodeDecodeError):
                data = raw.decode() if refused % 2 else raw
            if is_taken_in_part(data):
                continue
            await client.socket.send(data)
            async with asyncio.timeout(5.0 * PACE):
                while (answer := await client.read())["type"] == "telemetry":
                    assert answer["leases"] == 0
            assert answer["type"] == "error", (data, answer)
            assert answer["text"]
            refused += 1
        after = status(service)
        assert is_silent(after)
        assert after["plate"]["setpoint_c"] == before["plate"]["setpoint_c"]
        assert after["leases"] == 0
        assert (await client.touch("contact", "table"))["type"] == "ok"


async def test_frames_of_three_seconds_at_60_a_second_are_all_answered(service):
    async with peer(service) as client:
        await owner_of(client)
        ids: set[int] = set()
        answers: set[int] = set()

        async def read():
            while len(answers) < 180:
                answer = await client.read()
                if answer["type"] in ("decision", "skipped", "error") and answer["id"]:
                    answers.add(answer["id"])

        reading = asyncio.create_task(read())
        started = time.monotonic()
        for number in range(180):
            await asyncio.sleep(max(0.0, started + number / 60 - time.monotonic()))
            ids.add(await client.send(**frame(number, object_id="thing")))
        async with asyncio.timeout(5.0 * PACE):
            await reading
        assert answers == ids


async def test_the_gain_a_person_set_survives_a_crash_of_the_engine_and_a_reconnect(service):
    async def loudest(client):
        level = 0.0
        for _ in range(20):
            await client.touch("slide", "table", speed_mps=0.5, force_n=3.0)
            level = max(level, status(service)["speaker"]["level"])
            await asyncio.sleep(0.03)
        await client.touch("release")
        return level

    async with peer(service) as client:
        await owner_of(client)
        full = await loudest(client)
        await client.ask(type="set", vibration_gain=0.1)
        await asyncio.sleep(0.1)
        quiet = await loudest(client)
        before = status(service)["speaker"]
        os.kill(before["pid"], signal.SIGKILL)
        await until(service, lambda found: plays_anew(found, before), RESTART_S)
        assert quiet < 0.3 * full
        assert 0.0 < await loudest(client) < 0.3 * full
    async with peer(service) as newcomer:
        await owner_of(newcomer)
        await asyncio.sleep(0.1)
        assert 0.0 < await loudest(newcomer) < 0.3 * full  # and a reconnect
        await newcomer.ask(type="set", vibration_gain=1.0)
        await asyncio.sleep(0.1)
        assert await loudest(newcomer) > 0.5 * full


def noise(seed):
    """A picture of 640 x 640 px that no codec makes small."""
    pixels = np.random.default_rng(seed).integers(0, 255, (640, 640, 3), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "JPEG", quality=90)
    return buffer.getvalue()


async def fill_the_buffers(client):
    """Show an observer that does not read more than its buffers hold: some 9 MB."""
    for number in range(30):
        fields = {"image": noise(number), "width": 640, "height": 640}
        answer = await client.ask(**frame(number, object_id=f"thing {number}", **fields))
        assert answer["type"] == "decision"


@pytest.mark.realtime
async def test_the_service_stops_at_once_although_a_client_does_not_read():
    small = socket.socket()
    small.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with running() as service:
        small.connect(("127.0.0.1", int(service.url.rstrip("/").rsplit(":", 1)[1])))
        small.setblocking(False)
        async with peer(service, sock=small) as lazy, peer(service) as client:
            await lazy.hello("observer")
            await owner_of(client)
            await lazy.ask(type="set", watch=["frames"])
            lazy.socket.transport.pause_reading()
            await fill_the_buffers(client)
            await client.touch("contact", "table")
            started = time.monotonic()
            service.process.send_signal(signal.SIGTERM)
            assert await asyncio.to_thread(service.process.wait, 8.0) == 0
            assert time.monotonic() - started < 4.0
            lazy.socket.transport.abort()


@pytest.mark.realtime
async def test_a_region_touch_is_decided_while_frames_stream(service):
    async with peer(service) as client:
        await owner_of(client)
        region = {"x": 0.1, "y": 0.1, "w": 0.8, "h": 0.8}
        before = status(service)["counts"]
        for number in range(30):
            await client.send(**frame(number + 500))
            phase = "slide" if number else "contact"
            assert (await client.touch(phase, region=region))["type"] == "ok"
            await asyncio.sleep(0.02)
        event = await client.event("decision", id=0)
        assert event["source"] in ("encoder", "unknown")
        await client.touch("release")
        after = status(service)["counts"]
        new = after["recognitions"] - before.get("recognitions", 0)
        assert new > 10 / PACE  # as many as this machine can
        assert after.get("refused: model") == before.get("refused: model")
