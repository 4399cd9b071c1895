"""`hapticvlm stream` of a capture and of a headset's screen recording, to the real service."""

import asyncio
import json
import subprocess
import sys
import time
import types
from typing import Any

import cv2
import tiny_video
from certificates import Authority
from conftest import peer
from in_process import hapticvlm
from pace import PACE
from scene_client import picture

from hapticvlm import captures
from hapticvlm.client import connect
from hapticvlm.client.local_service import running
from hapticvlm.client.sending import stream
from hapticvlm.demo import CAPTURE

FRAMES = CAPTURE / "frames"
PATIENCE_S = 300.0 * PACE
NOBODY = types.SimpleNamespace(url="ws://127.0.0.1:9/")


def recording(path, count=20):
    """A screen recording of two seconds, made of the project's own rendered frames."""
    files = [str(FRAMES / f"{20 + n:04}.jpg") for n in range(count)]
    pictures: Any = [cv2.imread(file) for file in files]
    return tiny_video.write(path, pictures)


def streamed(path, service, *options):
    return subprocess.run(
        [sys.executable, "-m", "hapticvlm", "stream", str(path), "--url", service.url, *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def test_the_middle_of_a_recording_is_decided_and_every_message_answered(service, tmp_path):
    done = streamed(recording(tmp_path / "quest.mp4"), service, "--json", "--centre", "0.5")
    assert done.returncode == 0, done.stderr
    decisions = [json.loads(line) for line in done.stdout.splitlines()]
    assert decisions
    assert {decision["object_id"] for decision in decisions} == {captures.CENTRE}
    assert decisions == sorted(decisions, key=lambda decision: decision["t_s"])
    said = " ".join(done.stderr.split())
    assert "20 frame" in said
    assert "unanswered: 0" in said
    assert "error" not in said


async def test_the_middle_is_felt_from_the_first_frame_to_the_last(service, tmp_path):
    capture = captures.read(recording(tmp_path / "quest.mp4"))
    touches, leases = [], []

    def seen(line, answer):
        if line.type == "touch":
            assert answer["type"] == "ok", answer
            touches.append(line)

    async with peer(service) as observer:
        await observer.hello("observer")
        async with connect(service.url) as client:
            await client.touch("release")
            sending = asyncio.create_task(stream(client, capture, seen=seen))
            while not sending.done():
                leases.append((await observer.telemetry())["leases"])
            outcome = await sending
            await asyncio.sleep(0.2)
            ended = await observer.telemetry()
    phases = [line.fields["phase"] for line in touches]
    assert (phases[0], phases[-1]) == ("contact", "release")
    assert set(phases[1:-1]) == {"slide"}
    assert max(leases) == 1
    assert ended["leases"] == 0
    assert outcome.sent["touch"] == len(touches)
    assert outcome.sent.total() == outcome.answers.total() + outcome.unanswered
    assert touches[-1].t_s > 1.9


class SlowlyDecoded(captures.Capture):
    """A recording whose frames take a second each; lines that need no picture stand for them."""

    def lines(self):
        for number in range(3):
            time.sleep(1.0)
            yield captures.Line(number / 30.0, "set", {"ambient_c": 21.0})


async def test_touches_are_renewed_however_slowly_a_video_is_decoded(service, tmp_path):
    touches = []

    def seen(line, answer):
        assert answer["type"] == "ok"
        touches.append(line.type == "touch")

    slow = SlowlyDecoded(tmp_path / "slow.mp4", 0.1, 3, captures.Touched())
    async with connect(service.url) as client:
        outcome = await stream(client, slow, seen=seen)
    assert sum(touches) > 20  # 75 on a machine with nothing else to do; 2 if they waited in line
    assert outcome.late_s > 1.0


def test_streaming_a_capture_prints_decisions_and_answers_everything(service, tmp_path):
    lines = [
        {"t_s": 0.0, "type": "scene", "objects": [{"object_id": "a", "name": "Oak"}]},
        {"t_s": 0.1, "type": "touch", "phase": "contact", "object_id": "a", "hand": "left"},
        {"t_s": 0.2, "type": "frame", "object_id": "b", "file": "f.jpg", "truth": "wood"},
    ]
    lines[0]["replace"] = True
    lines[1] |= {"speed_mps": 0.1, "force_n": 1.0, "captured_at": 0.1}
    lines[2] |= {"format": "jpeg", "width": 64, "height": 64, "origin": "top", "captured_at": 0.2}
    (tmp_path / "capture.jsonl").write_text("\n".join(json.dumps(line) for line in lines))
    (tmp_path / "f.jpg").write_bytes(picture())
    done = streamed(tmp_path, service, "--json")
    decisions = [json.loads(line) for line in done.stdout.splitlines()]
    assert [decision["truth"] for decision in decisions] == ["wood"]
    assert "unanswered: 0" in " ".join(done.stderr.split())
    told = streamed(tmp_path, service)
    assert "unanswered: 0" in " ".join(told.stdout.split())


def test_an_address_where_nothing_can_be_sent_is_refused_with_what_to_do(service, tmp_path):
    pair = Authority(tmp_path).sign()
    (tmp_path / "capture.jsonl").write_text("")
    with running(["--tls-cert", str(pair.cert), "--tls-key", str(pair.key)]) as encrypted:
        for url, cure in (
            (NOBODY.url, "`hapticvlm serve` starts a service"),
            (service.url.replace("ws", "wss", 1), "that `hapticvlm serve` prints"),
            (encrypted.url, "--ca FILE"),
        ):
            done = hapticvlm("stream", str(tmp_path), "--url", url)
            assert (done.code, cure in done.err) == (2, True), done.err
            assert "Traceback" not in done.err
    assert encrypted.process.returncode == 0  # it was asked to end, not killed


def test_a_share_that_is_none_is_refused(tmp_path):
    for share in ("0", "1.5", "-1"):
        done = streamed(tmp_path, NOBODY, f"--centre={share}")
        assert done.returncode == 2
        assert f"{share} is not within 0.01..1" in done.stderr


def test_a_video_without_frames_is_refused_in_one_line(tmp_path):
    path = tiny_video.write(tmp_path / "quest.mp4", tiny_video.shades(3))
    tiny_video.blank(path)
    done = streamed(path, NOBODY)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == [
        f"hapticvlm stream: {path}: no frame can be decoded; is the file complete?"
    ]
