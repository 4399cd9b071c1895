"""Recording on a slow or full disk loses lines, counts them, and disturbs nothing else."""

import asyncio
import json
import logging
import re
import subprocess
import sys
import threading

import pace
import pytest
from conftest import peer, status
from scene_client import OBJECTS, frame, is_silent, until

from hapticvlm.client.local_service import running
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Frame
from hapticvlm.recordings import replay
from hapticvlm.recordings.recorder import SESSION_LOG, Recorder
from hapticvlm.server.log_writer import ObserverLog

TICK = {"now": 1.0, "in": "tick", "reading": {}}


def numbers(folder):
    (session,) = folder.iterdir()
    return [json.loads(line)["line"] for line in (session / SESSION_LOG).read_text().splitlines()]


def until_written(recorder):
    """Wait until the recorder's thread has nothing left to do."""
    pace.until(lambda: recorder._queue.unfinished_tasks == 0)


def test_lines_that_a_slow_disk_loses_leave_a_gap_in_the_session_log(tmp_path):
    recorder = Recorder(tmp_path, frames=False)
    tell = recorder.begin({"owner": True})
    told = 4 * 2000
    for _ in range(told):
        tell(TICK, None)
    until_written(recorder)
    tell(TICK, None)
    recorder.close()
    written = numbers(tmp_path)
    assert recorder.lost > 0
    assert written[-1] == told + 1
    assert len(written) == told + 2 - recorder.lost


def test_pictures_that_wait_for_a_slow_disk_are_bounded_and_not_held_unless_kept(tmp_path):
    picture = Frame(
        id=1,
        captured_at=0.0,
        format="rgb8",
        width=1024,
        height=1024,
        image=bytes(3 * 1024**2),
        origin="top",
    )
    for frames in (True, False):
        recorder = Recorder(tmp_path / str(frames), frames=frames)
        tell = recorder.begin({"owner": True})
        for _ in range(100):
            tell(TICK, picture)
            assert recorder.waiting_bytes <= ((64 * 1024**2) if frames else 0)
        recorder.close()
        assert (recorder.lost > 0) == frames


def test_two_services_that_record_into_one_folder_do_not_write_into_each_other(tmp_path):
    recorders = [Recorder(tmp_path, frames=False) for _ in range(3)]
    for recorder in recorders:
        tell = recorder.begin({"owner": True})
        tell(TICK, None)
    for recorder in recorders:
        recorder.close()
        assert recorder.lost == 0
    logs = [path / SESSION_LOG for path in tmp_path.iterdir()]
    assert [len(log.read_text().splitlines()) for log in logs] == [2, 2, 2]


async def test_a_log_line_of_another_thread_reaches_observers_on_the_event_loop():
    shown = []
    log = ObserverLog(lambda text: shown.append((text, threading.current_thread())))
    record = logging.makeLogRecord({"msg": "no room in \udcff"})  # as a path that is no UTF-8
    await asyncio.to_thread(log.emit, record)
    await asyncio.sleep(0)
    assert shown == [("no room in", threading.current_thread())]


# The log may grow to so many bytes: the kernel then takes part of a line, as a full disk does.
FULL = """
import resource, signal, sys
from pathlib import Path
from hapticvlm.messages import Frame
from hapticvlm.recordings.recorder import Recorder
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.dont_write_bytecode = True  # a part of it would be kept
recorder = Recorder(Path(sys.argv[1]), frames=True)
tell = recorder.begin({"owner": True})
picture = Frame(
    id=1, captured_at=0.0, format="rgb8", width=16, height=16, image=bytes(768), origin="top"
)
resource.setrlimit(resource.RLIMIT_FSIZE, (400, resource.RLIM_INFINITY))
for number in range(100):
    tell({"now": 1.0, "in": "tick", "reading": {}}, picture if number == 1 else None)
recorder.close()
print(recorder.lost)
"""


def test_neither_a_line_nor_a_picture_that_a_full_disk_cuts_is_kept(tmp_path):
    pytest.importorskip("resource", reason="limits of a process, which Windows lacks")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path)], capture_output=True, text=True, check=True
    )
    written = numbers(tmp_path)  # every one is whole
    assert written == [number for number in range(len(written) + 1) if number != 2]
    assert len(written) == 101 - int(done.stdout)
    assert list(tmp_path.rglob("*.rgb")) == []
    assert re.search(r"000001\.rgb: .*; (free|raise)", done.stderr)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits another process's files")
async def test_on_a_full_disk_the_session_goes_on_and_the_loss_is_counted_shown_and_logged(
    tmp_path, monkeypatch
):
    import resource

    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # a part of it would be kept
    with running(["--record", str(tmp_path)]) as service:
        async with peer(service) as client, peer(service) as watching:
            await client.hello()
            await watching.hello("observer")
            await watching.ask(type="set", watch=["log"])
            await client.ask(type="scene", objects=OBJECTS, replace=True)
            await until(service, lambda found: found["record"]["written_bytes"] > 0)
            limits = resource.prlimit(service.process.pid, resource.RLIMIT_FSIZE)
            resource.prlimit(service.process.pid, resource.RLIMIT_FSIZE, (1, limits[1]))
            await until(service, lambda found: found["record"]["lost_lines"] > 20)
            line = await watching.event("view", kind="log")
            assert "the record misses" in line["text"]
            assert "record misses" in (await client.event("error", code="overload"))["text"]
            while is_silent(status(service)):  # a lease may lapse before a busy machine looks
                await client.touch("release")
                assert (await client.touch("contact", "table"))["type"] == "ok"
            resource.prlimit(service.process.pid, resource.RLIMIT_FSIZE, limits)
            before = status(service)["record"]["written_bytes"]
            await until(service, lambda found: found["record"]["written_bytes"] > before)
            await client.touch("release")
        said = [line for line in service.printed if "misses" in line]
        assert len(said) <= 6
    (session,) = tmp_path.iterdir()
    assert replay.replay(session, MATERIALS).missing > 20


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other permissions")
async def test_a_record_is_readable_by_its_user_alone_and_holds_no_token(tmp_path):
    folder = tmp_path / "record"
    arguments = ["--record", str(folder), "--record-frames", "--token", "s3cret-of-a-session"]
    with running(arguments) as service:
        async with peer(service) as client:
            await client.hello(token="s3cret-of-a-session")
            again = await client.hello(token="s3cret-of-a-session")  # refused, and recorded
            assert again["type"] == "error"
            await client.ask(**frame(1, object_id="thing"))
            await until(service, lambda found: found["record"]["written_bytes"] > 5000)
    found = [folder, *folder.rglob("*")]
    assert len(found) >= 5
    for path in found:
        assert path.stat().st_mode & 0o077 == 0, path
        assert path.is_dir() or b"s3cret" not in path.read_bytes()
